//! SERV-CT (Edwards et al. 2022): an experiment's folder with `Left_rectified/NNN.png`, `Right_rectified/`,
//! `Rectified_calibration/NNN.json` with the projections `P1` and `P2` (pixels, millimetres), and the reference depth of
//! the left view in `Ground_truth_CT/DepthL/` (or `Reference_CT/`; 16 bits, 1/256 mm).
//!
//! The pairs are stills of different scenes, each with its own calibration. Pairs of one calibration make a recording;
//! where an experiment has several, a pair is imported alone, by its left image's path.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::{Pinhole, StereoRig};
use serde_json::Value;

use super::{DepthEncoding, DepthFile, Given, Images, Plan, PlannedFrame, files};
use crate::{Calibration, RecordingError};

const LEFT: &str = "Left_rectified";
const DEPTHS: [&str; 2] = ["Ground_truth_CT/DepthL", "Reference_CT/DepthL"];
const MM: f64 = 1e-3;
/// Millimetres of one unit of depth.
const DEPTH_UNIT_MM: f64 = 1.0 / 256.0;
/// Stills have no time: one a second.
const FRAME_RATE_HZ: f64 = 1.0;
const SAME_TOLERANCE: f64 = 1e-9;

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let (experiment, only) = experiment(source)?;
    let (left, right) = (experiment.join(LEFT), experiment.join("Right_rectified"));
    let mut pairs =
        files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?)?;
    pairs.retain(|(number, ..)| only.is_none_or(|only| only == *number));
    let rate_hz = given.frame_rate_hz.unwrap_or(FRAME_RATE_HZ);
    let calibration = match given.rig {
        Some(rig) => rig.calibration,
        None => common_calibration(&experiment, &pairs)?,
    };
    let mut depths = depths(&experiment)?;
    let frames = pairs.iter().map(|(number, ..)| PlannedFrame {
        depth: depths.remove(number).map(|path| DepthFile {
            path,
            encoding: DepthEncoding::Gray16,
            unit_m: DEPTH_UNIT_MM * MM,
        }),
        ..PlannedFrame::at(files::stamp_ns(*number, rate_hz))
    });
    let frames = frames.collect();
    let images = Images::of_pairs(pairs);
    Ok(Plan { calibration, frames, images })
}

/// The experiment's folder, and the pair's number where one is named.
fn experiment(source: &Path) -> Result<(PathBuf, Option<u64>), RecordingError> {
    if source.is_dir() {
        return Ok((source.to_path_buf(), None));
    }
    let stem = source.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let folder = source.parent().filter(|folder| folder.file_name().is_some_and(|name| name == LEFT));
    match (folder.and_then(Path::parent), stem.parse()) {
        (Some(experiment), Ok(number)) => Ok((experiment.to_path_buf(), Some(number))),
        _ => Err(RecordingError::input(source, format!("neither an experiment's folder nor {LEFT}/NNN.png"))),
    }
}

fn depths(experiment: &Path) -> Result<BTreeMap<u64, PathBuf>, RecordingError> {
    match DEPTHS.into_iter().map(|name| experiment.join(name)).find(|folder| folder.is_dir()) {
        Some(folder) => files::numbered_images(&folder),
        None => Ok(BTreeMap::new()),
    }
}

fn common_calibration(
    experiment: &Path,
    pairs: &[(u64, PathBuf, PathBuf)],
) -> Result<Calibration, RecordingError> {
    let mut common: Option<(PathBuf, StereoRig)> = None;
    for (_, left, _) in pairs {
        let name = left.with_extension("json");
        let path = experiment.join("Rectified_calibration").join(name.file_name().unwrap_or_default());
        let rig = read_rig(&path, files::image_size_px(left)?)?;
        match &common {
            Some((first, known)) if !is_same(known, &rig) => {
                let problem = format!(
                    "another calibration than {}: import one pair, PATH/{LEFT}/NNN.png",
                    first.display()
                );
                return Err(RecordingError::input(&path, problem));
            }
            Some(_) => {}
            None => common = Some((path, rig)),
        }
    }
    let none = || RecordingError::input(experiment, "no such pair");
    common.map(|(_, rig)| Calibration::Rectified(rig)).ok_or_else(none)
}

fn is_same(a: &StereoRig, b: &StereoRig) -> bool {
    let numbers = |rig: &StereoRig| {
        let Pinhole { fx_px, fy_px, cx_px, cy_px, .. } = rig.left;
        [fx_px, fy_px, cx_px, cy_px, rig.right_cx_px, rig.baseline_m]
    };
    numbers(a).iter().zip(numbers(b)).all(|(a, b)| (a - b).abs() <= SAME_TOLERANCE * a.abs().max(1.0))
}

fn read_rig(path: &Path, (width_px, height_px): (u32, u32)) -> Result<StereoRig, RecordingError> {
    let refused = |problem: String| RecordingError::input(path, problem);
    let file: Value =
        serde_json::from_str(&files::text(path)?).map_err(|error| refused(error.to_string()))?;
    let [left, right] = ["P1", "P2"].map(|key| projection(&file, key).map_err(refused));
    let (left, right) = (left?, right?);
    let baseline_m = -right[3] / right[0] * MM;
    if !(left[0] > 0.0 && left[5] > 0.0 && right[0] > 0.0) {
        return Err(refused(format!("P1, P2: focal lengths {}, {}, {} px", left[0], left[5], right[0])));
    }
    if baseline_m <= 0.0 {
        return Err(refused(format!("P2[3] = {}, it must be -fx * baseline", right[3])));
    }
    let left_pinhole =
        Pinhole { width_px, height_px, fx_px: left[0], fy_px: left[5], cx_px: left[2], cy_px: left[6] };
    Ok(StereoRig { left: left_pinhole, baseline_m, right_cx_px: right[2] })
}

/// A 3x4 matrix: a list, a list of rows, or the `data` of one.
fn projection(file: &Value, key: &str) -> Result<[f64; 12], String> {
    let value = file.get(key).ok_or_else(|| format!("{key} is missing"))?;
    let mut numbers = Vec::new();
    collect(value.get("data").unwrap_or(value), &mut numbers)
        .ok_or_else(|| format!("{key} is no matrix of numbers"))?;
    <[f64; 12]>::try_from(numbers.as_slice())
        .map_err(|_| format!("{key} has {} numbers, not 12", numbers.len()))
}

fn collect(value: &Value, numbers: &mut Vec<f64>) -> Option<()> {
    match value {
        Value::Array(values) => values.iter().try_for_each(|value| collect(value, numbers)),
        _ => value.as_f64().map(|number| numbers.push(number)),
    }
}
