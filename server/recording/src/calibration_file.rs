//! Calibration files as other tools write them, to one rig.
//!
//! Known are, beside this project's own rig files: OpenCV's stereo calibration, a pair of ROS `camera_info` files,
//! Kalibr's camera chain, the INI file of StereoMIS, and the text files of the Hamlyn data sets. What a file is shows in
//! its content; each refusal names the file and the field.

mod camera_info;
mod hamlyn;
mod ini;
mod kalibr;
mod numbers;
mod opencv;
mod stereo;
mod yaml;

use std::path::{Path, PathBuf};

use yaml_rust2::Yaml;

use crate::{Calibration, RecordingError, RigFile};

/// What calibration files leave unsaid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationHints {
    /// Columns and rows of the images, for files that do not tell.
    pub image_px: Option<(u32, u32)>,
    /// Metres for each unit of a translation, for files that do not tell: OpenCV's have the unit of the board's squares.
    pub unit_m: f64,
}

/// Files that make a folder a calibration.
const FILES: [&str; 7] = [
    "rig.toml",
    "StereoCalibration.ini",
    "endoscope_calibration.yaml",
    "stereo.yaml",
    "stereo.yml",
    "camchain.yaml",
    hamlyn::EXTRINSIC,
];

/// Reads a calibration file, or the one in a folder.
///
/// # Errors
/// [`RecordingError::Io`], or [`RecordingError::Input`] naming the file and the field that is wrong.
pub fn read_calibration(path: &Path, hints: &CalibrationHints) -> Result<RigFile, RecordingError> {
    let path = file_of(path)?;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let calibration = match extension.to_ascii_lowercase().as_str() {
        "toml" => return RigFile::read(&path),
        "ini" => ini::read(&path),
        "txt" => hamlyn::read(&path, hints),
        "yaml" | "yml" => read_yaml(&path, hints),
        _ => Err(RecordingError::input(
            &path,
            "calibrations are read from .toml, .yaml, .yml, .ini and .txt files",
        )),
    }?;
    Ok(RigFile { calibration, frame_rate_hz: None, depth_unit_m: None })
}

fn read_yaml(path: &Path, hints: &CalibrationHints) -> Result<Calibration, RecordingError> {
    let document = yaml::read(path)?;
    let has = |key: &str| !matches!(document[key], Yaml::BadValue);
    if has("cam0") {
        kalibr::parse(&document).map_err(|problem| RecordingError::input(path, problem))
    } else if has("projection_matrix") {
        camera_info::read(path, &document)
    } else {
        opencv::read(path, &document, hints)
    }
}

/// The file itself, or the one that a folder is known by.
fn file_of(path: &Path) -> Result<PathBuf, RecordingError> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let names = FILES.iter().copied().chain(camera_info::LEFT_NAMES).chain([opencv::INTRINSICS]);
    let found = names.clone().map(|name| path.join(name)).find(|file| file.is_file());
    found.ok_or_else(|| {
        let names = names.collect::<Vec<_>>().join(", ");
        RecordingError::input(path, format!("no calibration in this folder; looked for {names}"))
    })
}
