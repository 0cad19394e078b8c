//! EuRoC MAV: two cameras that are not rectified, and poses of the body that carries them.
//!
//! Read are the data set's own layout (`mav0/cam0/data/NS.png`, `mav0/cam0/sensor.yaml`, ground truth as CSV) and
//! the flat one of keyframes (`images/NS_0.jpg`, `cam0_sensor.yaml`, ground truth as TUM).
//!
//! The true pose of a frame is that of the *rectified* left camera, which is what a tracker of rectified images sees:
//! `world_from_body * body_from_left * left_from_rectified`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use geometry::{Pose, StereoCalibration};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::opencv_yaml::{self, SensorFile};
use super::{Given, Images, Plan, PlannedFrame, files};
use crate::export::read_tum;
use crate::{Calibration, RecordingError};

/// Farthest ground truth from an image's stamp that is taken for its own: half a period of the 200 Hz ground truth.
const TRUTH_TOLERANCE_NS: u64 = 2_500_000;

pub(super) fn plan(source: &Path, given: Given) -> Result<Plan, RecordingError> {
    let root = if source.join("mav0").is_dir() { source.join("mav0") } else { source.to_path_buf() };
    let sensor = |camera: &str| {
        let names = [format!("{camera}/sensor.yaml"), format!("{camera}_sensor.yaml")];
        opencv_yaml::read(&files::first_existing(
            &root,
            &names.each_ref().map(String::as_str),
            "the camera file",
        )?)
    };
    let (left, right) = (sensor("cam0")?, sensor("cam1")?);
    let calibration = given.rig.map_or_else(|| raw_calibration(&left, &right), |rig| rig.calibration);
    let body_from_rectified = left.body_from_camera * files::left_from_rectified(&calibration)?;
    let truth = read_truth(&root)?;
    let pairs = pairs(&root)?;
    let frames = pairs.iter().map(|&(stamp_ns, ..)| PlannedFrame {
        world_from_camera: nearest(&truth, stamp_ns)
            .map(|world_from_body| world_from_body * body_from_rectified),
        ..PlannedFrame::at(stamp_ns)
    });
    let frames = frames.collect();
    Ok(Plan { calibration, frames, images: Images::of_pairs(pairs) })
}

fn raw_calibration(left: &SensorFile, right: &SensorFile) -> Calibration {
    Calibration::Raw(StereoCalibration {
        left: left.camera,
        right: right.camera,
        right_from_left: right.body_from_camera.inverse() * left.body_from_camera,
    })
}

fn pairs(root: &Path) -> Result<Vec<(u64, PathBuf, PathBuf)>, RecordingError> {
    let [left, right] = ["cam0/data", "cam1/data"].map(|name| root.join(name));
    if left.is_dir() {
        return files::pairs(&left, files::numbered_images(&left)?, &right, files::numbered_images(&right)?);
    }
    let folder = root.join("images");
    let (mut left, mut right) = (BTreeMap::new(), BTreeMap::new());
    for (stem, path) in files::images(&folder)? {
        let (stamp, eye) = stem.text().split_once('_').unwrap_or((stem.text(), ""));
        let stamp_ns = stamp.parse::<u64>().ok();
        match (stamp_ns, eye) {
            (Some(stamp_ns), "0") => left.insert(stamp_ns, path),
            (Some(stamp_ns), "1") => right.insert(stamp_ns, path),
            _ => return Err(RecordingError::input(&path, "the name is not NANOSECONDS_0 or NANOSECONDS_1")),
        };
    }
    files::pairs(&folder, left, &folder, right)
}

/// The poses of the body by time; empty without ground truth.
fn read_truth(root: &Path) -> Result<BTreeMap<u64, Pose>, RecordingError> {
    let csv = root.join("state_groundtruth_estimate0/data.csv");
    if csv.exists() {
        return read_csv(&csv);
    }
    let entries = std::fs::read_dir(root).map_err(RecordingError::io(root))?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    let mut paths = paths.collect::<Result<Vec<_>, _>>().map_err(RecordingError::io(root))?;
    paths.retain(|path| path.file_name().is_some_and(|name| name.to_string_lossy().ends_with("_gt_imu.txt")));
    match paths.as_slice() {
        [] => Ok(BTreeMap::new()),
        [path] => Ok(read_tum(path)?.into_iter().map(by_stamp).collect()),
        _ => Err(RecordingError::input(root, "more than one ground truth, *_gt_imu.txt")),
    }
}

fn by_stamp(pose: StampedPose) -> (u64, Pose) {
    (pose.stamp_ns, pose.world_from_camera)
}

/// `stamp_ns, px, py, pz, qw, qx, qy, qz`, then velocities and biases.
fn read_csv(path: &Path) -> Result<BTreeMap<u64, Pose>, RecordingError> {
    let refused = |error: csv::Error| RecordingError::input(path, error);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_path(path).map_err(refused)?;
    let rows = reader.deserialize::<(u64, [f64; 3], [f64; 4])>();
    rows.map(|row| {
        let (stamp_ns, [x, y, z], [qw, qx, qy, qz]) = row.map_err(refused)?;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
        Ok((stamp_ns, Pose::from_parts(Translation3::new(x, y, z), rotation)))
    })
    .collect()
}

fn nearest(truth: &BTreeMap<u64, Pose>, stamp_ns: u64) -> Option<&Pose> {
    let before = truth.range(..=stamp_ns).next_back();
    let after = truth.range(stamp_ns..).next();
    let found = before.into_iter().chain(after).min_by_key(|(time_ns, _)| time_ns.abs_diff(stamp_ns));
    found.filter(|(time_ns, _)| time_ns.abs_diff(stamp_ns) <= TRUTH_TOLERANCE_NS).map(|(_, pose)| pose)
}
