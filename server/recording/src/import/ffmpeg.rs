//! Video files through FFmpeg's programs: `ffprobe` tells sizes and times, `ffmpeg` gives the pictures one by one.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use geometry::{Raster, Rgb};
use serde::Deserialize;

use crate::RecordingError;

const BYTES_PER_PIXEL: usize = 3;
/// Largest side of a picture that is believed: two of 8192 beside each other.
const SIDE_MAX_PX: u32 = 16_384;

/// The programs.
#[derive(Clone, Debug)]
pub(super) struct Ffmpeg {
    ffmpeg: PathBuf,
    ffprobe: PathBuf,
}

/// What a video file says of itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct VideoFacts {
    pub width_px: u32,
    pub height_px: u32,
    /// When each picture is shown, from the first on; `None` where the file does not tell all.
    pub stamps_ns: Option<Vec<u64>>,
    pub pictures: usize,
}

#[derive(Deserialize)]
struct Probed {
    #[serde(default)]
    packets: Vec<Packet>,
    #[serde(default)]
    streams: Vec<Stream>,
}

#[derive(Deserialize)]
struct Packet {
    pts_time: Option<String>,
}

#[derive(Deserialize)]
struct Stream {
    width: u32,
    height: u32,
}

impl Ffmpeg {
    /// The installed ones.
    pub fn installed() -> Self {
        Self { ffmpeg: "ffmpeg".into(), ffprobe: "ffprobe".into() }
    }

    /// Reads a file's head and index.
    ///
    /// # Errors
    /// [`RecordingError::Input`] where FFmpeg is missing or finds no video in the file.
    pub fn probe(&self, path: &Path) -> Result<VideoFacts, RecordingError> {
        if !path.is_file() {
            return Err(RecordingError::input(path, "no such video file"));
        }
        let mut command = Command::new(&self.ffprobe);
        command.args(["-v", "error", "-select_streams", "v:0", "-of", "json"]);
        command.args(["-show_entries", "stream=width,height:packet=pts_time"]).arg(path);
        let output = command.stdin(Stdio::null()).output().map_err(|error| missing(&self.ffprobe, &error))?;
        if !output.status.success() {
            let told = String::from_utf8_lossy(&output.stderr);
            let told = told.lines().last().unwrap_or("ffprobe failed").trim().to_owned();
            return Err(RecordingError::input(path, format!("FFmpeg cannot read it: {told}")));
        }
        let probed: Probed = serde_json::from_slice(&output.stdout)
            .map_err(|error| RecordingError::input(path, format!("ffprobe's answer: {error}")))?;
        facts(&probed).map_err(|problem| RecordingError::input(path, problem))
    }

    /// Starts decoding a file from its first picture.
    ///
    /// # Errors
    /// [`RecordingError::Input`] where FFmpeg is missing.
    pub fn decode(&self, path: &Path, facts: &VideoFacts) -> Result<Pictures, RecordingError> {
        let mut command = Command::new(&self.ffmpeg);
        command.args(["-nostdin", "-v", "quiet", "-noautorotate", "-i"]).arg(path);
        command.args(["-map", "0:v:0"]).args(self.one_by_one()?);
        command.args(["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().map_err(|error| missing(&self.ffmpeg, &error))?;
        let stdout = child.stdout.take().expect("it was asked for");
        let size_px = (facts.width_px, facts.height_px);
        Ok(Pictures { child, stdout, size_px, done: 0, of: facts.pictures, path: path.to_path_buf() })
    }

    /// The option that keeps FFmpeg from doubling and dropping pictures; releases before 5.1 call it `-vsync`.
    fn one_by_one(&self) -> Result<[&'static str; 2], RecordingError> {
        let mut command = Command::new(&self.ffmpeg);
        let help = command.args(["-hide_banner", "-h", "long"]).stdin(Stdio::null()).output();
        let help = help.map_err(|error| missing(&self.ffmpeg, &error))?;
        let knows = String::from_utf8_lossy(&help.stdout).contains("-fps_mode");
        Ok([if knows { "-fps_mode" } else { "-vsync" }, "passthrough"])
    }
}

fn missing(program: &Path, error: &std::io::Error) -> RecordingError {
    let problem =
        format!("{error}; videos are read through FFmpeg: install it (config/setup.sh does) and try again");
    RecordingError::input(program, problem)
}

fn facts(probed: &Probed) -> Result<VideoFacts, String> {
    let [stream] = &probed.streams[..] else { return Err("there is no video in this file".into()) };
    let (width_px, height_px) = (stream.width, stream.height);
    if !(1..=SIDE_MAX_PX).contains(&width_px) || !(1..=SIDE_MAX_PX).contains(&height_px) {
        return Err(format!("pictures of {width_px}x{height_px} px are not read"));
    }
    if probed.packets.is_empty() {
        return Err("there is no picture in this video".into());
    }
    let times_s = probed.packets.iter().map(|packet| packet.pts_time.as_deref()?.parse::<f64>().ok());
    let times_s =
        times_s.collect::<Option<Vec<f64>>>().filter(|times| times.iter().all(|time| time.is_finite()));
    Ok(VideoFacts { width_px, height_px, stamps_ns: times_s.map(from_first), pictures: probed.packets.len() })
}

/// Times in the order in which they are shown, from the first on.
fn from_first(mut times_s: Vec<f64>) -> Vec<u64> {
    times_s.sort_by(f64::total_cmp);
    let first_s = times_s.first().copied().unwrap_or(0.0);
    times_s.into_iter().map(|time_s| ((time_s - first_s) * 1e9).round() as u64).collect()
}

/// A video being decoded.
pub(super) struct Pictures {
    child: Child,
    stdout: ChildStdout,
    size_px: (u32, u32),
    done: usize,
    of: usize,
    path: PathBuf,
}

impl Pictures {
    /// Columns and rows.
    pub fn size_px(&self) -> (u32, u32) {
        self.size_px
    }

    /// Picture `number` of the file, counted from 0; those before it are skipped and cannot be had any more.
    ///
    /// # Errors
    /// [`RecordingError::Input`] where the video ends before.
    pub fn picture(&mut self, number: usize) -> Result<Rgb, RecordingError> {
        let (width, height) = self.size_px;
        let mut bytes = vec![0; width as usize * height as usize * BYTES_PER_PIXEL];
        while self.done <= number {
            self.stdout.read_exact(&mut bytes).map_err(|_| self.ended())?;
            self.done += 1;
        }
        let pixels = bytes.as_chunks::<BYTES_PER_PIXEL>().0.to_vec();
        Ok(Raster::from_vec(width, height, pixels).expect("as many bytes were read"))
    }

    fn ended(&self) -> RecordingError {
        let problem = format!("FFmpeg gave {} pictures of the {} that its index lists", self.done, self.of);
        RecordingError::input(&self.path, problem)
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        // It may have ended already; nothing is left to do about one that cannot be stopped.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_ffmpeg_the_error_says_what_to_install() {
        let ffmpeg = Ffmpeg { ffmpeg: "/nonexistent/ffmpeg".into(), ffprobe: "/nonexistent/ffprobe".into() };
        let video = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let told = ffmpeg.probe(&video).unwrap_err().to_string();
        assert!(told.contains("install it (config/setup.sh does)"), "{told}");
    }

    #[test]
    fn pictures_are_timed_in_the_order_in_which_they_are_shown() {
        let packets = |times: &[&str]| {
            let packets: Vec<String> =
                times.iter().map(|time| format!("{{\"pts_time\": \"{time}\"}}")).collect();
            let text = format!(
                "{{\"packets\": [{}], \"streams\": [{{\"width\": 8, \"height\": 4}}]}}",
                packets.join(",")
            );
            facts(&serde_json::from_str(&text).unwrap())
        };
        let reordered = packets(&["1.00", "1.12", "1.04", "1.08"]).unwrap();
        assert_eq!(reordered.stamps_ns.unwrap(), [0, 40_000_000, 80_000_000, 120_000_000]);
        assert_eq!(packets(&["0.0", "N/A"]).unwrap().stamps_ns, None);
        assert!(packets(&[]).unwrap_err().contains("no picture"));
    }
}
