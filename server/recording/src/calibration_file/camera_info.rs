//! ROS `camera_info` files, as `camera_calibration` writes them: one for each eye, the right one with
//! `projection_matrix[3] = -fx * baseline` in metres. The eye's name in the file name leads to the other file.

use std::path::{Path, PathBuf};

use geometry::Eye;
use yaml_rust2::Yaml;

use super::numbers::{exactly, of_file, side_px};
use super::yaml;
use crate::calibration::{CameraRecord, from_records};
use crate::{Calibration, RecordingError};

/// Names of a left file in a folder.
pub(super) const LEFT_NAMES: [&str; 4] =
    ["left.yaml", "left.yml", "left_camera_info.yaml", "camera_info_left.yaml"];

pub(super) fn read(path: &Path, document: &Yaml) -> Result<Calibration, RecordingError> {
    let (left_path, right_path) = both(path)?;
    let (left, right);
    if path == left_path {
        left = of_file(&left_path, record(document))?;
        right = of_file(&right_path, record(&yaml::read(&right_path)?))?;
    } else {
        left = of_file(&left_path, record(&yaml::read(&left_path)?))?;
        right = of_file(&right_path, record(document))?;
    }
    let calibration = from_records(&left, &right).map_err(|wrong| {
        let path = if wrong.eye == Eye::Left { &left_path } else { &right_path };
        RecordingError::input(path, format!("{}: {}", wrong.field, wrong.problem))
    })?;
    Ok(calibration)
}

/// The files of both eyes, from either.
fn both(path: &Path) -> Result<(PathBuf, PathBuf), RecordingError> {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let other =
        |from: &str, to: &str| name.contains(from).then(|| path.with_file_name(name.replacen(from, to, 1)));
    let (left, right) = match (other("left", "right"), other("right", "left")) {
        (Some(right), _) => (path.to_path_buf(), right),
        (None, Some(left)) => (left, path.to_path_buf()),
        (None, None) => {
            let problem =
                "a camera_info file is of one eye: left or right must be in its name, to find the other";
            return Err(RecordingError::input(path, problem));
        }
    };
    for file in [&left, &right] {
        if !file.is_file() {
            return Err(RecordingError::input(file, "the other eye's camera_info is missing"));
        }
    }
    Ok((left, right))
}

fn record(document: &Yaml) -> Result<CameraRecord, String> {
    let side = |key: &str| side_px(key, yaml::number(document, key)?);
    let matrix = |key: &str| yaml::numbers(document, key);
    let record = CameraRecord {
        width: side("image_width")?,
        height: side("image_height")?,
        distortion_model: document["distortion_model"].as_str().unwrap_or_default().to_owned(),
        d: matrix("distortion_coefficients")?,
        k: exactly("camera_matrix", &matrix("camera_matrix")?)?,
        r: exactly("rectification_matrix", &matrix("rectification_matrix")?)?,
        p: exactly("projection_matrix", &matrix("projection_matrix")?)?,
    };
    for (field, value) in [("camera_matrix: fx", record.k[0]), ("projection_matrix: fx", record.p[0])] {
        if value <= 0.0 {
            return Err(format!("{field} = {value}, it must be above 0"));
        }
    }
    Ok(record)
}
