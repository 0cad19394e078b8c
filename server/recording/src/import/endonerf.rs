//! EndoNeRF (Wang et al. 2022): `images/` and `images_right/` of one rectified view, `masks/` (instruments white), and
//! `poses_bounds.npy`: for each frame a 3x5 matrix, row by row, whose columns are the camera's down, right and backward
//! axes in the world, its place, and height, width and focal length; then two bounds of depth. Places have no stated
//! unit: the poses are taken where the camera stands still, else left out.
//!
//! The set tells no baseline, so a calibration is needed; its focal length must be that of the set. Depth in `depth/`
//! (made by a network, of no stated unit) is taken where a rig file says its unit.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::Pose;
use nalgebra::{Matrix3, Vector3};

use super::files::Stem;
use super::{DepthEncoding, DepthFile, Given, Images, MaskFile, MaskMeaning, Plan, PlannedFrame, files};
use crate::rotation::pose_from_rows;
use crate::{Calibration, RecordingError};

const POSES: &str = "poses_bounds.npy";
/// Numbers of a frame.
const ROW: usize = 17;
/// Largest difference of focal lengths that is no contradiction.
const FOCAL_TOLERANCE: f64 = 0.01;
/// Most bytes of the file of poses: some hundred thousand frames.
const BYTES_MAX: u64 = 1 << 24;

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let rig = given.rig_or(|| {
        let problem = "the set does not tell its baseline: name a calibration with --calibration";
        Err(RecordingError::input(source, problem))
    })?;
    let rate_hz = rig.rate_hz(source)?;
    let (left, right) = (source.join("images"), source.join("images_right"));
    let pairs = files::pairs(&left, by_number(&left)?, &right, by_number(&right)?)?;
    let poses = read_poses(&source.join(POSES), &rig.calibration)?;
    if !poses.is_empty() && poses.len() != pairs.len() {
        let problem = format!("{} poses for {} pairs", poses.len(), pairs.len());
        return Err(RecordingError::input(&source.join(POSES), problem));
    }
    let mut masks = optional(&source.join("masks"))?;
    let mut depths =
        if rig.depth_unit_m.is_some() { optional(&source.join("depth"))? } else { BTreeMap::new() };
    let frames = (0..).zip(&pairs).map(|(index, (number, ..))| PlannedFrame {
        mask: masks.remove(number).map(|path| MaskFile { path, meaning: MaskMeaning::InstrumentIsBright }),
        depth: depths.remove(number).zip(rig.depth_unit_m).map(|(path, unit_m)| DepthFile {
            path,
            encoding: DepthEncoding::Gray16,
            unit_m,
        }),
        world_from_camera: poses.get(index).copied(),
        ..PlannedFrame::at(files::stamp_ns(index as u64, rate_hz))
    });
    let frames = frames.collect();
    let images = Images::of_pairs(pairs);
    Ok(Plan { calibration: rig.calibration, frames, images })
}

/// Images by the first number in their names: `frame-000012.color.png` is 12.
fn by_number(folder: &Path) -> Result<BTreeMap<u64, PathBuf>, RecordingError> {
    files::images_by(folder, Stem::first_number, "no frame's number in the name")
}

fn optional(folder: &Path) -> Result<BTreeMap<u64, PathBuf>, RecordingError> {
    if folder.is_dir() { by_number(folder) } else { Ok(BTreeMap::new()) }
}

/// The poses in the order of frames; empty without the file.
fn read_poses(path: &Path, calibration: &Calibration) -> Result<Vec<Pose>, RecordingError> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let refused = |problem: String| RecordingError::input(path, problem);
    let bytes = std::fs::metadata(path).map_err(RecordingError::io(path))?.len();
    if bytes > BYTES_MAX {
        return Err(refused(format!("{bytes} bytes are no poses")));
    }
    let bytes = std::fs::read(path).map_err(RecordingError::io(path))?;
    let file = npyz::NpyFile::new(&bytes[..]).map_err(|error| refused(error.to_string()))?;
    let shape = file.shape().to_vec();
    if shape.len() != 2 || shape[1] != ROW as u64 || file.order() != npyz::Order::C {
        return Err(refused(format!("shape {shape:?}, not (frames, {ROW}) row by row")));
    }
    let numbers: Vec<f64> =
        file.into_vec().map_err(|error| refused(format!("not 64-bit floats: {error}")))?;
    let rows = numbers.as_chunks::<ROW>().0.iter().enumerate();
    let pose =
        |(frame, row)| pose(row, calibration).map_err(|problem| refused(format!("frame {frame}: {problem}")));
    let poses = rows.map(pose).collect::<Result<Vec<Pose>, _>>()?;
    let stands_still = poses.iter().all(|pose| pose.translation == poses[0].translation);
    Ok(if stands_still { poses } else { Vec::new() })
}

fn pose(row: &[f64; ROW], calibration: &Calibration) -> Result<Pose, String> {
    let column = |index: usize| Vector3::new(row[index], row[5 + index], row[10 + index]);
    let (down, right, backward, place, hwf) = (column(0), column(1), column(2), column(3), column(4));
    let focal_px = match calibration {
        Calibration::Rectified(rig) => rig.left.fx_px,
        Calibration::Raw(raw) => raw.left.pinhole.fx_px,
    };
    // Written so that a NaN is refused too.
    let is_near = (hwf.z - focal_px).abs() <= FOCAL_TOLERANCE * focal_px;
    if !is_near {
        return Err(format!("focal length {} px, but {focal_px} px in the calibration", hwf.z));
    }
    let axes = Matrix3::from_columns(&[right, down, -backward]);
    let rows: [f64; 12] =
        std::array::from_fn(|i| if i % 4 == 3 { place[i / 4] } else { axes[(i / 4, i % 4)] });
    pose_from_rows(&rows).ok_or_else(|| format!("{rows:?} is no rigid motion"))
}
