//! Hamlyn Centre in-vivo data sets, rectified: `left/` and `right/` with the frame's number as name.
//!
//! <https://hamlyn.doc.ic.ac.uk/vision/>, calibrations of the rectified distribution by Recasens et al. 2021
//! (Endo-Depth-and-Motion).

use std::path::Path;

use super::{Given, Images, Plan, PlannedFrame, files};
use crate::{RecordingError, RigFile};

/// The data sets whose rig is known, by the name of their folder.
const RIGS: [(&str, &str); 2] = [
    ("6", include_str!("../../../../config/rigs/hamlyn-06.toml")),
    ("20", include_str!("../../../../config/rigs/hamlyn-20.toml")),
];

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let rig = given.rig_or(|| known_rig(source))?;
    let rate_hz = rig.rate_hz(source)?;
    let (left, right) = (source.join("left"), source.join("right"));
    let pairs = files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    let frames = pairs.iter().map(|(number, ..)| PlannedFrame::at(files::stamp_ns(*number, rate_hz)));
    let frames = frames.collect();
    Ok(Plan { calibration: rig.calibration, frames, images: Images::of_pairs(pairs) })
}

fn known_rig(source: &Path) -> Result<RigFile, RecordingError> {
    // `.` and `x/..` have names too, once resolved.
    let resolved = source.canonicalize().map_err(RecordingError::io(source))?;
    let name = resolved.file_name().unwrap_or_default().to_string_lossy();
    let number = name.trim_start_matches(|c: char| !c.is_ascii_digit()).trim_start_matches('0');
    let known = RIGS.iter().find(|(set, _)| *set == number);
    let (_, text) = known.ok_or_else(|| {
        let sets = RIGS.map(|(set, _)| set).join(", ");
        RecordingError::input(
            source,
            format!("the rig of this set is not known (those of {sets} are): name it with --calibration"),
        )
    })?;
    RigFile::parse(text).map_err(|problem| RecordingError::input(source, problem))
}
