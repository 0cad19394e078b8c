//! OpenCV's stereo calibration: `M1 D1 M2 D2 R T`, in one file or in `intrinsics.yml` and `extrinsics.yml` as its own
//! sample writes them. `R` and `T` take points of the first camera to the second, in the unit of the board's squares.

use std::path::Path;

use yaml_rust2::Yaml;

use super::numbers::{of_file, side_px};
use super::stereo::{self, CameraNumbers};
use super::{CalibrationHints, yaml};
use crate::{Calibration, RecordingError};

/// The file of OpenCV's sample that holds the cameras.
pub(super) const INTRINSICS: &str = "intrinsics.yml";
/// The one beside it that holds the motion.
const EXTRINSICS: &str = "extrinsics.yml";
/// Names in use for the intrinsic matrices and coefficients, left and right.
const CAMERAS: [[&str; 4]; 4] = [
    ["M1", "D1", "M2", "D2"],
    ["K1", "D1", "K2", "D2"],
    ["cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2"],
    [
        "left_camera_matrix",
        "left_distortion_coefficients",
        "right_camera_matrix",
        "right_distortion_coefficients",
    ],
];
const SIZES: [&str; 3] = ["image_size", "imageSize", "size"];

pub(super) fn read(
    path: &Path,
    document: &Yaml,
    hints: &CalibrationHints,
) -> Result<Calibration, RecordingError> {
    let beside = path.with_file_name(EXTRINSICS);
    if yaml::has(document, "R") || !beside.is_file() {
        return of_file(path, parse(document, document, hints));
    }
    let motion = yaml::read(&beside)?;
    of_file(&beside, yaml::numbers(&motion, "R").and(yaml::numbers(&motion, "T")))?;
    of_file(path, parse(document, &motion, hints))
}

fn parse(cameras: &Yaml, motion: &Yaml, hints: &CalibrationHints) -> Result<Calibration, String> {
    let names = CAMERAS.iter().find(|names| yaml::has(cameras, names[0]));
    let [left, left_lens, right, right_lens] = *names.ok_or_else(|| {
        let known = CAMERAS.map(|names| names[0]).join(", ");
        format!("no left camera; looked for cam0 (Kalibr), projection_matrix (ROS) and {known} (OpenCV)")
    })?;
    let size_px = size_px(cameras, hints)?;
    let camera = |matrix: &str, lens: &str| {
        let coefficients = yaml::numbers(cameras, lens)?;
        let intrinsic = (matrix, yaml::array(cameras, matrix)?);
        stereo::camera(&CameraNumbers { size_px, intrinsic, distortion: (lens, &coefficients) })
    };
    let (rotation, translation) = (yaml::numbers(motion, "R")?, yaml::numbers(motion, "T")?);
    let right_from_left = stereo::right_from_left(["R", "T"], &rotation, &translation, hints.unit_m)?;
    stereo::rig(camera(left, left_lens)?, camera(right, right_lens)?, right_from_left)
}

fn size_px(document: &Yaml, hints: &CalibrationHints) -> Result<(u32, u32), String> {
    if yaml::has(document, "image_width") {
        let side = |key: &str| side_px(key, yaml::number(document, key)?);
        return Ok((side("image_width")?, side("image_height")?));
    }
    if let Some(key) = SIZES.into_iter().find(|key| yaml::has(document, key)) {
        let [width, height] = yaml::array(document, key)?;
        return Ok((side_px(key, width)?, side_px(key, height)?));
    }
    hints.image_px.ok_or_else(|| "image_width and image_height are missing, and no image tells them".into())
}
