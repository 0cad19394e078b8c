//! A virtual X display whose contents can be looked at.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use geometry::Rgb;

/// A running Xvfb; ended when dropped.
pub struct VirtualDisplay {
    child: Child,
    directory: tempfile::TempDir,
    /// `:N`, for the environment variable `DISPLAY`.
    pub name: String,
}

impl VirtualDisplay {
    /// A display of this size; `None`, said aloud, where there is no Xvfb.
    ///
    /// # Panics
    /// Where Xvfb does not come up.
    pub fn start((width, height): (u32, u32)) -> Option<Self> {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let mut command = Command::new("Xvfb");
        command.args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0"]);
        command.arg(format!("{width}x{height}x24")).arg("-fbdir").arg(directory.path());
        let Ok(mut child) = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn() else {
            eprintln!("skipped: there is no Xvfb; config/setup.sh --test installs it");
            return None;
        };
        let mut number = String::new();
        let mut out = BufReader::new(child.stdout.take().expect("stdout is piped"));
        out.read_line(&mut number).expect("Xvfb says its number");
        assert!(!number.trim().is_empty(), "Xvfb ended: {:?}", child.wait());
        Some(Self { child, directory, name: format!(":{}", number.trim()) })
    }

    fn frame_buffer(&self) -> PathBuf {
        self.directory.path().join("Xvfb_screen0")
    }

    /// What is on the screen: an XWD file of 32-bit pixels (X11/XWDFile.h).
    ///
    /// # Panics
    /// Where the file is none.
    pub fn picture(&self) -> Rgb {
        let bytes = std::fs::read(self.frame_buffer()).expect("the display's contents");
        let field = |number: usize| {
            let bytes = bytes[number * 4..][..4].try_into().expect("four bytes");
            u32::from_be_bytes(bytes) as usize
        };
        let (header, width, height, row_bytes, colors) = (field(0), field(4), field(5), field(12), field(19));
        let pixels = &bytes[header + colors * 12..];
        Rgb::from_fn(width as u32, height as u32, |x, y| {
            let at = y as usize * row_bytes + x as usize * 4;
            [pixels[at + 2], pixels[at + 1], pixels[at]]
        })
    }
}

impl Drop for VirtualDisplay {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
