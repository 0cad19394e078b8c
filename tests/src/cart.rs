//! A real `mis-slam-cart`.

use std::path::Path;
use std::process::{Child, Stdio};

use crate::process;

/// A cart that streams a recording over and over; killed when dropped.
pub struct Cart(Child);

impl Cart {
    /// Starts a cart that feeds `session` of the server at `to`.
    pub fn start(recording: &Path, to: &str, session: &str) -> Self {
        let mut command = process::program("mis-slam-cart");
        command.arg(recording).args(["--to", to, "--session", session, "--loop"]);
        Self(command.stdout(Stdio::null()).spawn().expect("the cart starts"))
    }

    /// As when its power fails.
    pub fn kill(&mut self) {
        self.0.kill().expect("the cart can be killed");
        self.0.wait().expect("the cart is gone");
    }
}

impl Drop for Cart {
    fn drop(&mut self) {
        // It may have ended by itself, which a test then sees in what it measures.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
