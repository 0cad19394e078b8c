//! A clip of a surgical robot: `left/`, `right/`, instrument masks in `mask/`, and for some frames the depth of
//! the data set's own stereo in `depth16/` (16 bits, 0 where unknown).

use std::path::Path;

use super::{DepthEncoding, DepthFile, Plan, PlannedFrame, files};
use crate::{RecordingError, RigFile};

const RIG: &str = include_str!("../../../../config/rigs/d4d.toml");

pub(super) fn plan(source: &Path, rig: Option<RigFile>) -> Result<Plan, RecordingError> {
    let refused = |problem: String| RecordingError::input(source, problem);
    let rig = match rig {
        Some(rig) => rig,
        None => RigFile::parse(RIG).map_err(refused)?,
    };
    let unit_m = rig.depth_unit_m.ok_or_else(|| refused("the rig file has no depth_unit_mm".into()))?;
    let (left, right) = (source.join("left"), source.join("right"));
    let pairs = files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    let mut masks = files::numbered_images(&source.join("mask"))?;
    let mut depths = files::numbered_images(&source.join("depth16"))?;
    let frames = pairs.into_iter().map(|(number, left, right)| PlannedFrame {
        mask: masks.remove(&number),
        depth: depths.remove(&number).map(|path| DepthFile { path, encoding: DepthEncoding::Gray16, unit_m }),
        ..PlannedFrame::of_images(files::stamp_ns(number, rig.frame_rate_hz), left, right)
    });
    Ok(Plan { calibration: rig.calibration, frames: frames.collect() })
}
