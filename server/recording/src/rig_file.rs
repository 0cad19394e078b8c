//! The project's own calibration files; `config/rigs/README.md` documents the keys.

use std::path::Path;

use geometry::{CameraModel, Pinhole, Pose, StereoCalibration, StereoRig};
use nalgebra::Translation3;
use serde::Deserialize;

use crate::calibration::distortion;
use crate::rotation::rotation_from_rows;
use crate::{Calibration, RecordingError};

const M_PER_MM: f64 = 1e-3;

/// A stereo rig and what a data set of it leaves unsaid.
#[derive(Clone, Debug, PartialEq)]
pub struct RigFile {
    /// The cameras.
    pub calibration: Calibration,
    /// Images a second, for data sets whose images have no time of their own; calibrations of other tools do not tell.
    pub frame_rate_hz: Option<f64>,
    /// Metres for each unit of the data set's depth files.
    pub depth_unit_m: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    frame_rate_hz: f64,
    depth_unit_mm: Option<f64>,
    rectified: Option<RectifiedTable>,
    raw: Option<RawTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RectifiedTable {
    width_px: u32,
    height_px: u32,
    fx_px: f64,
    fy_px: f64,
    cx_px: f64,
    cy_px: f64,
    right_cx_px: f64,
    baseline_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTable {
    right_from_left_rotation: [f64; 9],
    right_from_left_translation_mm: [f64; 3],
    left: CameraTable,
    right: CameraTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    width_px: u32,
    height_px: u32,
    fx_px: f64,
    fy_px: f64,
    cx_px: f64,
    cy_px: f64,
    distortion_model: String,
    distortion: Vec<f64>,
}

impl RigFile {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`RecordingError::Io`], or [`RecordingError::Input`] naming the key that is wrong.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let text = std::fs::read_to_string(path).map_err(RecordingError::io(path))?;
        Self::parse(&text).map_err(|problem| RecordingError::input(path, problem))
    }

    /// The rate at which images of `source` without times of their own were taken.
    pub(crate) fn rate_hz(&self, source: &Path) -> Result<f64, RecordingError> {
        self.frame_rate_hz.ok_or_else(|| {
            let problem =
                "neither the images nor the calibration tell the frame rate: name it with --frame-rate";
            RecordingError::input(source, problem)
        })
    }

    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let document: Document = toml::from_str(text).map_err(|error| error.to_string())?;
        let positive = |key: &str, value: f64| {
            let sound = value.is_finite() && value > 0.0;
            if sound { Ok(value) } else { Err(format!("{key} = {value}, it must be above 0")) }
        };
        let unit_m = |mm| positive("depth_unit_mm", mm).map(|mm| mm * M_PER_MM);
        let calibration = match (document.rectified, document.raw) {
            (Some(table), None) => Calibration::Rectified(rectified(&table)),
            (None, Some(table)) => Calibration::Raw(raw(&table)?),
            _ => return Err("one table is needed, [rectified] or [raw]".into()),
        };
        Ok(Self {
            calibration,
            frame_rate_hz: Some(positive("frame_rate_hz", document.frame_rate_hz)?),
            depth_unit_m: document.depth_unit_mm.map(unit_m).transpose()?,
        })
    }
}

fn rectified(table: &RectifiedTable) -> StereoRig {
    let &RectifiedTable { width_px, height_px, fx_px, fy_px, cx_px, cy_px, right_cx_px, baseline_mm } = table;
    let left = Pinhole { width_px, height_px, fx_px, fy_px, cx_px, cy_px };
    StereoRig { left, baseline_m: baseline_mm * M_PER_MM, right_cx_px }
}

fn raw(table: &RawTable) -> Result<StereoCalibration, String> {
    let rotation = rotation_from_rows(&table.right_from_left_rotation).ok_or_else(|| {
        format!("raw.right_from_left_rotation = {:?} is no rotation", table.right_from_left_rotation)
    })?;
    let [x, y, z] = table.right_from_left_translation_mm.map(|mm| mm * M_PER_MM);
    Ok(StereoCalibration {
        left: camera("raw.left", &table.left)?,
        right: camera("raw.right", &table.right)?,
        right_from_left: Pose::from_parts(Translation3::new(x, y, z), rotation),
    })
}

fn camera(name: &str, table: &CameraTable) -> Result<CameraModel, String> {
    let &CameraTable { width_px, height_px, fx_px, fy_px, cx_px, cy_px, .. } = table;
    let distortion = distortion(&table.distortion_model, &table.distortion)
        .map_err(|(field, problem)| format!("{name}: {field}: {problem}"))?;
    Ok(CameraModel { pinhole: Pinhole { width_px, height_px, fx_px, fy_px, cx_px, cy_px }, distortion })
}
