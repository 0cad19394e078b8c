//! Rendered colon and stomach pairs with depth (data of BDIS, Song et al. 2022): `left/`, `right/`, `depth_rg/`.
//!
//! The scene has no scale: f * B is 260 px * units. The rig file says how long a unit is.
//! Frames are not consecutive; their numbers give nominal stamps, and gaps stay gaps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{DepthEncoding, DepthFile, Given, Images, Plan, PlannedFrame, files};
use crate::{RecordingError, RigFile};

const RIG: &str = include_str!("../../../../config/rigs/bdis.toml");

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let refused = |problem: String| RecordingError::input(source, problem);
    let rig = given.rig_or(|| RigFile::parse(RIG).map_err(refused))?;
    let rate_hz = rig.rate_hz(source)?;
    let unit_m = rig.depth_unit_m.ok_or_else(|| refused("the rig file has no depth_unit_mm".into()))?;
    let (left, right) = (source.join("left"), source.join("right"));
    let pairs = files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    let depths = files::numbered_images(&source.join("depth_rg"))?;
    let shift = numbering_shift(&depths, pairs.first().map(|(number, ..)| *number));
    let frames = pairs.iter().map(|(number, ..)| {
        let path = number.checked_sub(shift).and_then(|number| depths.get(&number));
        let depth =
            path.map(|path| DepthFile { path: path.clone(), encoding: DepthEncoding::RedGreen, unit_m });
        PlannedFrame { depth, ..PlannedFrame::at(files::stamp_ns(*number, rate_hz)) }
    });
    let frames = frames.collect();
    Ok(Plan { calibration: rig.calibration, frames, images: Images::of_pairs(pairs) })
}

/// In some sets depth is numbered from 0 while images are numbered from 1: image k then goes with depth k - 1.
fn numbering_shift(depths: &BTreeMap<u64, PathBuf>, first_image: Option<u64>) -> u64 {
    u64::from(depths.contains_key(&0) && first_image != Some(0))
}
