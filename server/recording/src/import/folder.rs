//! `left/` and `right/` with image pairs of equal names, in natural order, at the rig file's frame rate.

use std::path::Path;

use super::{Given, Images, Plan, PlannedFrame, files};
use crate::{RecordingError, RigFile};

/// The rig file that the folder may hold itself.
const RIG_FILE: &str = "rig.toml";

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let rig = given.rig_or(|| own_rig(source))?;
    let rate_hz = rig.rate_hz(source)?;
    let (left, right) = (source.join("left"), source.join("right"));
    let pairs = files::pairs(&left, files::images(&left)?, &right, files::images(&right)?)?;
    let stamps_ns = (0..pairs.len() as u64).map(|index| files::stamp_ns(index, rate_hz));
    let frames = stamps_ns.map(PlannedFrame::at).collect();
    Ok(Plan { calibration: rig.calibration, frames, images: Images::of_pairs(pairs) })
}

fn own_rig(source: &Path) -> Result<RigFile, RecordingError> {
    let path = source.join(RIG_FILE);
    if !path.exists() {
        let problem = "no calibration: put a rig file there or name one with --calibration (see config/rigs)";
        return Err(RecordingError::input(&path, problem));
    }
    RigFile::read(&path)
}
