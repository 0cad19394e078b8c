//! A clip of a surgical robot: `left/`, `right/`, instrument masks in `mask/`, and for some frames the depth of
//! the data set's own stereo in `depth16/` (16 bits, 0 where unknown).

use std::path::Path;

use super::{DepthEncoding, DepthFile, Given, Images, MaskFile, MaskMeaning, Plan, PlannedFrame, files};
use crate::{RecordingError, RigFile};

const RIG: &str = include_str!("../../../../config/rigs/d4d.toml");

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let refused = |problem: String| RecordingError::input(source, problem);
    let rig = given.rig_or(|| RigFile::parse(RIG).map_err(refused))?;
    let rate_hz = rig.rate_hz(source)?;
    let unit_m = rig.depth_unit_m.ok_or_else(|| refused("the rig file has no depth_unit_mm".into()))?;
    let (left, right) = (source.join("left"), source.join("right"));
    let pairs = files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    let mut masks = files::numbered_images(&source.join("mask"))?;
    let mut depths = files::numbered_images(&source.join("depth16"))?;
    let frames = pairs.iter().map(|(number, ..)| PlannedFrame {
        mask: masks.remove(number).map(|path| MaskFile { path, meaning: MaskMeaning::InstrumentIsBright }),
        depth: depths.remove(number).map(|path| DepthFile { path, encoding: DepthEncoding::Gray16, unit_m }),
        ..PlannedFrame::at(files::stamp_ns(*number, rate_hz))
    });
    let frames = frames.collect();
    Ok(Plan { calibration: rig.calibration, frames, images: Images::of_pairs(pairs) })
}
