//! StereoMIS (Hayoz et al. 2023): a sequence's folder with one video (left eye above), `StereoCalibration.ini`,
//! `groundtruth.txt` with `frame tx ty tz qx qy qz qw` of the left camera (metres, by the robot's kinematics),
//! `masks/NNNNNNl.png` for some frames (0 where an instrument is), and the usable frames in `*_split.csv`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::Pose;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::files::{left_from_rectified, with_extension};
use super::stereo_video::{OpenedVideo, VideoFiles};
use super::{Given, Images, MaskFile, MaskMeaning, Plan, PlannedFrame, files};
use crate::RecordingError;
use crate::calibration_file::{CalibrationHints, read_calibration};

const CALIBRATION: &str = "StereoCalibration.ini";
/// Largest departure of a printed quaternion from unit length.
const UNIT_TOLERANCE: f64 = 1e-3;

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let frame_rate_hz = given.frame_rate_hz;
    let rig = given.rig_or(|| {
        read_calibration(&source.join(CALIBRATION), &CalibrationHints { image_px: None, unit_m: 1e-3 })
    })?;
    let video = OpenedVideo::open(VideoFiles::One(the_video(source)?))?;
    let stamps_ns = video.stamps_ns(frame_rate_hz)?;
    let left_from_rectified = left_from_rectified(&rig.calibration)?;
    let poses = read_poses(&source.join("groundtruth.txt"))?;
    let mut masks = read_masks(&source.join("masks"))?;
    let numbers = used(source, stamps_ns.len())?;
    let frame = |&number: &usize| PlannedFrame {
        mask: masks.remove(&(number as u64)),
        world_from_camera: poses.get(&(number as u64)).map(|pose| pose * left_from_rectified),
        ..PlannedFrame::at(stamps_ns[number])
    };
    let frames = numbers.iter().map(frame).collect();
    let images = Images::Video { video: video.decode(rig.calibration.image_size_px())?, numbers };
    Ok(Plan { calibration: rig.calibration, frames, images })
}

fn the_video(source: &Path) -> Result<PathBuf, RecordingError> {
    match with_extension(source, "mp4")?.as_slice() {
        [video] => Ok(video.clone()),
        found => Err(RecordingError::input(source, format!("{} videos (*.mp4), not one", found.len()))),
    }
}

/// Numbers of the pictures to import: those of the split, or all.
fn used(source: &Path, pictures: usize) -> Result<Vec<usize>, RecordingError> {
    let splits = with_extension(source, "csv")?;
    let is_split = |path: &&PathBuf| path.to_string_lossy().ends_with("_split.csv");
    let Some(path) = splits.iter().find(is_split) else { return Ok((0..pictures).collect()) };
    let refused = |error: csv::Error| RecordingError::input(path, error);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(refused)?;
    let mut numbers = Vec::new();
    for row in reader.deserialize() {
        let (first, last): (usize, usize) = row.map_err(refused)?;
        numbers.extend(first..=last.min(pictures.saturating_sub(1)));
    }
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}

/// Poses of the left camera by the picture's number; empty without the file.
fn read_poses(path: &Path) -> Result<BTreeMap<u64, Pose>, RecordingError> {
    let mut poses = BTreeMap::new();
    if !path.exists() {
        return Ok(poses);
    }
    for (line, content) in (1..).zip(files::text(path)?.lines()) {
        if content.trim().is_empty() || content.starts_with('#') {
            continue;
        }
        let (number, pose) = parse_pose(content)
            .map_err(|problem| RecordingError::input(path, format!("line {line}: {problem}")))?;
        poses.insert(number, pose);
    }
    Ok(poses)
}

fn parse_pose(line: &str) -> Result<(u64, Pose), String> {
    let words =
        line.split_whitespace().map(|word| word.parse().map_err(|_| format!("{word:?} is no number")));
    let numbers = words.collect::<Result<Vec<f64>, String>>()?;
    let [frame, x, y, z, qx, qy, qz, qw] = numbers[..] else {
        return Err(format!("{} numbers, not frame tx ty tz qx qy qz qw", numbers.len()));
    };
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    let is_sound = [x, y, z].iter().all(|value| value.is_finite())
        && (quaternion.norm() - 1.0).abs() < UNIT_TOLERANCE
        && frame >= 0.0
        && frame.fract() == 0.0;
    if !is_sound {
        return Err(format!("{numbers:?} is no frame with a pose"));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    Ok((frame as u64, Pose::from_parts(Translation3::new(x, y, z), rotation)))
}

/// Masks by the picture's number; empty without the folder.
fn read_masks(folder: &Path) -> Result<BTreeMap<u64, MaskFile>, RecordingError> {
    let mut masks = BTreeMap::new();
    if !folder.is_dir() {
        return Ok(masks);
    }
    for path in with_extension(folder, "png")? {
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let number = stem.strip_suffix('l').and_then(|number| number.parse().ok());
        if let Some(number) = number {
            masks.insert(number, MaskFile { path, meaning: MaskMeaning::TissueIsBright });
        }
    }
    Ok(masks)
}
