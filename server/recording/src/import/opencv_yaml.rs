//! The camera files of EuRoC: YAML as OpenCV writes it, with a `%YAML:1.0` line that YAML itself does not allow.

use std::path::Path;

use geometry::{CameraModel, Pinhole, Pose};
use yaml_rust2::{Yaml, YamlLoader};

use super::files;
use crate::RecordingError;
use crate::calibration::distortion;
use crate::rotation::pose_from_rows;

/// One camera of a sensor rig.
pub(super) struct SensorFile {
    pub camera: CameraModel,
    /// Takes points of the camera to the body of the rig; `T_BS` in the file.
    pub body_from_camera: Pose,
}

pub(super) fn read(path: &Path) -> Result<SensorFile, RecordingError> {
    let text = files::text(path)?;
    parse(&text).map_err(|problem| RecordingError::input(path, problem))
}

fn parse(text: &str) -> Result<SensorFile, String> {
    let text = text.strip_prefix("%YAML:1.0").unwrap_or(text);
    let documents = YamlLoader::load_from_str(text).map_err(|error| error.to_string())?;
    let file = documents.first().ok_or("the file is empty")?;
    if file["camera_model"].as_str() != Some("pinhole") {
        return Err(format!("camera_model: {:?} is not read; pinhole is", file["camera_model"]));
    }
    let [width, height] = numbers(file, "resolution")?;
    let [fx_px, fy_px, cx_px, cy_px] = numbers(file, "intrinsics")?;
    let model = file["distortion_model"].as_str().unwrap_or_default();
    let coefficients = sequence(file, "distortion_coefficients")?;
    let pinhole = Pinhole { width_px: width as u32, height_px: height as u32, fx_px, fy_px, cx_px, cy_px };
    let distortion = distortion(model, &coefficients)
        .map_err(|(_, problem)| format!("distortion_model, distortion_coefficients: {problem}"))?;
    let [rows @ .., _, _, _, _] = numbers::<16>(&file["T_BS"], "data")?;
    let body_from_camera =
        pose_from_rows(&rows).ok_or_else(|| format!("T_BS = {rows:?} is no rigid motion"))?;
    Ok(SensorFile { camera: CameraModel { pinhole, distortion }, body_from_camera })
}

fn sequence(table: &Yaml, key: &str) -> Result<Vec<f64>, String> {
    let values = table[key].as_vec().ok_or_else(|| format!("{key} is missing"))?;
    let number = |value: &Yaml| value.as_f64().or_else(|| value.as_i64().map(|value| value as f64));
    values.iter().map(|value| number(value).ok_or_else(|| format!("{key}: {value:?} is no number"))).collect()
}

fn numbers<const N: usize>(table: &Yaml, key: &str) -> Result<[f64; N], String> {
    let values = sequence(table, key)?;
    <[f64; N]>::try_from(values.as_slice())
        .map_err(|_| format!("{key} has {} numbers, not {N}", values.len()))
}
