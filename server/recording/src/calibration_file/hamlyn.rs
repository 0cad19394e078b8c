//! The text files of the Hamlyn data sets: `Left_Camera_Calibration_Intrinsic.txt` and the right one's with the rows of
//! the intrinsic matrix and a line of lens coefficients, `camera_extrinsic.txt` with the rows of the rotation and a line
//! with the translation (millimetres), which take points of the left camera to the right one.

use std::path::Path;

use geometry::CameraModel;

use super::CalibrationHints;
use super::numbers::{exactly, of_file, of_line};
use super::stereo::{self, CameraNumbers};
use crate::{Calibration, RecordingError};

/// The file with the motion between the cameras; the folder is known by it.
pub(super) const EXTRINSIC: &str = "camera_extrinsic.txt";
const LEFT: &str = "Left_Camera_Calibration_Intrinsic.txt";
const RIGHT: &str = "Right_Camera_Calibration_Intrinsic.txt";
const MM: f64 = 1e-3;

pub(super) fn read(path: &Path, hints: &CalibrationHints) -> Result<Calibration, RecordingError> {
    let extrinsic = path.with_file_name(EXTRINSIC);
    let (rotation, translation) = rows(&extrinsic, "rotation", "translation")?;
    let names = ["rotation", "translation"];
    let right_from_left = of_file(&extrinsic, stereo::right_from_left(names, &rotation, &translation, MM))?;
    let camera = |name: &str| {
        let path = path.with_file_name(name);
        let (intrinsic, lens) = rows(&path, "intrinsic matrix", "lens")?;
        of_file(&path, camera(&intrinsic, &lens, hints))
    };
    of_file(path, stereo::rig(camera(LEFT)?, camera(RIGHT)?, right_from_left))
}

fn camera(intrinsic: &[f64], lens: &[f64], hints: &CalibrationHints) -> Result<CameraModel, String> {
    let size_px =
        hints.image_px.ok_or("the size of the images is not in these files, and no image tells it")?;
    let intrinsic = ("intrinsic matrix", exactly("intrinsic matrix", intrinsic)?);
    stereo::camera(&CameraNumbers { size_px, intrinsic, distortion: ("lens", lens) })
}

/// The numbers of the first three lines, and those of the fourth; empty lines are skipped.
fn rows(path: &Path, matrix: &str, row: &str) -> Result<(Vec<f64>, Vec<f64>), RecordingError> {
    let text = std::fs::read_to_string(path).map_err(RecordingError::io(path))?;
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    let [a, b, c, last] = lines[..] else {
        let problem = format!("{} lines, not three of the {matrix} and one of the {row}", lines.len());
        return Err(RecordingError::input(path, problem));
    };
    let mut values = Vec::new();
    for line in [a, b, c] {
        values.extend(of_file(path, of_line(matrix, line))?);
    }
    Ok((values, of_file(path, of_line(row, last))?))
}
