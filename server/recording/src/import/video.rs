//! A stereo video: a file with both eyes in each picture, side by side (left eye left) or one above the other (left eye
//! above), or a folder with `left.*` and `right.*`. Which it is follows from the calibration's image size.

use std::path::{Path, PathBuf};

use super::stereo_video::{OpenedVideo, VideoFiles};
use super::{Given, Images, Plan, PlannedFrame};
use crate::RecordingError;

const EXTENSIONS: [&str; 8] = ["mp4", "mkv", "avi", "mov", "m4v", "webm", "ts", "mpg"];

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let frame_rate_hz = given.frame_rate_hz;
    let rig = given.rig_or(|| {
        let problem = "a video does not tell its cameras: name a calibration with --calibration";
        Err(RecordingError::input(source, problem))
    })?;
    let video = OpenedVideo::open(files(source)?)?;
    let stamps_ns = video.stamps_ns(frame_rate_hz)?;
    let images = Images::Video {
        video: video.decode(rig.calibration.image_size_px())?,
        numbers: (0..stamps_ns.len()).collect(),
    };
    let frames = stamps_ns.into_iter().map(PlannedFrame::at).collect();
    Ok(Plan { calibration: rig.calibration, frames, images })
}

fn files(source: &Path) -> Result<VideoFiles, RecordingError> {
    if !source.is_dir() {
        return Ok(VideoFiles::One(source.to_path_buf()));
    }
    let eye = |name: &str| {
        let candidates = EXTENSIONS.map(|extension| source.join(format!("{name}.{extension}")));
        let found: Option<PathBuf> = candidates.into_iter().find(|path| path.is_file());
        found.ok_or_else(|| {
            let known = EXTENSIONS.join(", ");
            RecordingError::input(source, format!("no {name}.* with one of the extensions {known}"))
        })
    };
    Ok(VideoFiles::Two(eye("left")?, eye("right")?))
}
