//! `left/` and `right/` with image pairs of equal names, in natural order, at the rig file's frame rate.

use std::path::Path;

use super::{Plan, PlannedFrame, files};
use crate::{RecordingError, RigFile};

/// The rig file that the folder may hold itself.
const RIG_FILE: &str = "rig.toml";

pub(super) fn plan(source: &Path, rig: Option<RigFile>) -> Result<Plan, RecordingError> {
    let rig = match rig {
        Some(rig) => rig,
        None => own_rig(source)?,
    };
    let (left, right) = (source.join("left"), source.join("right"));
    let pairs = files::pairs(&left, files::images(&left)?, &right, files::images(&right)?)?;
    let frames = (0..).zip(pairs).map(|(index, (_, left, right))| {
        PlannedFrame::of_images(files::stamp_ns(index, rig.frame_rate_hz), left, right)
    });
    Ok(Plan { calibration: rig.calibration, frames: frames.collect() })
}

fn own_rig(source: &Path) -> Result<RigFile, RecordingError> {
    let path = source.join(RIG_FILE);
    if !path.exists() {
        let problem = "no calibration: put a rig file there or name one with --calibration (see config/rigs)";
        return Err(RecordingError::input(&path, problem));
    }
    RigFile::read(&path)
}
