//! Refuses calibrations that no endoscope has, naming the field that is wrong.

use serde::{Deserialize, Serialize};

use crate::{CameraModel, GeometryError, Pinhole, StereoCalibration, StereoRig};

/// Largest image side (px) that any stage allocates for.
pub const IMAGE_SIDE_MAX_PX: u32 = 8192;

const METRES_TO_MM: f64 = 1000.0;

/// Which rigs are believed: section `[rig]` of the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigLimits {
    /// Least distance of the optical centres.
    pub baseline_min_mm: f64,
    /// Largest distance of the optical centres.
    pub baseline_max_mm: f64,
}

/// Checks a rectified rig.
///
/// # Errors
/// [`GeometryError::Field`], [`GeometryError::SwappedEyes`] or [`GeometryError::Baseline`], whichever is first.
pub fn check_rig(rig: &StereoRig, limits: &RigLimits) -> Result<(), GeometryError> {
    check_pinhole("left", &rig.left)?;
    check_inside("right_cx_px", rig.right_cx_px, rig.left.width_px)?;
    check_baseline(rig.baseline_m, limits)
}

/// Checks a pair of cameras that are still to be rectified.
///
/// # Errors
/// As [`check_rig`], and [`GeometryError::NotSideBySide`].
pub fn check_calibration(calibration: &StereoCalibration, limits: &RigLimits) -> Result<(), GeometryError> {
    let right_in_left = check_side_by_side(calibration)?;
    check_baseline(right_in_left.norm(), limits)
}

/// Everything about a raw calibration but the length of its baseline; gives the right camera's place.
pub(crate) fn check_side_by_side(
    calibration: &StereoCalibration,
) -> Result<nalgebra::Vector3<f64>, GeometryError> {
    check_camera("left", &calibration.left)?;
    check_camera("right", &calibration.right)?;
    check_same_size(calibration)?;
    let motion = &calibration.right_from_left;
    let rotation = motion.rotation.coords.iter().map(|&value| ("right_from_left.rotation", value));
    let translation = motion.translation.vector.iter().map(|&value| ("right_from_left.translation", value));
    for (field, value) in rotation.chain(translation) {
        check_finite(field, value)?;
    }
    let right_in_left = motion.inverse().translation.vector;
    if right_in_left.x.abs() <= right_in_left.yz().norm() {
        let t = motion.translation.vector;
        return Err(GeometryError::NotSideBySide { x_m: t.x, y_m: t.y, z_m: t.z });
    }
    if right_in_left.x < 0.0 {
        return Err(GeometryError::SwappedEyes { baseline_m: right_in_left.x });
    }
    Ok(right_in_left)
}

fn check_same_size(calibration: &StereoCalibration) -> Result<(), GeometryError> {
    let (left, right) = (&calibration.left.pinhole, &calibration.right.pinhole);
    for (field, left_px, right_px) in [
        ("right.width_px", left.width_px, right.width_px),
        ("right.height_px", left.height_px, right.height_px),
    ] {
        if left_px != right_px {
            return Err(refused(field, right_px, format!("the left camera's {left_px}")));
        }
    }
    Ok(())
}

fn check_baseline(baseline_m: f64, limits: &RigLimits) -> Result<(), GeometryError> {
    check_finite("baseline_m", baseline_m)?;
    if baseline_m < 0.0 {
        return Err(GeometryError::SwappedEyes { baseline_m });
    }
    let baseline_mm = baseline_m * METRES_TO_MM;
    let (min_mm, max_mm) = (limits.baseline_min_mm, limits.baseline_max_mm);
    if !(min_mm..=max_mm).contains(&baseline_mm) || baseline_mm == 0.0 {
        return Err(GeometryError::Baseline { baseline_mm, min_mm, max_mm });
    }
    Ok(())
}

fn check_camera(name: &str, camera: &CameraModel) -> Result<(), GeometryError> {
    check_pinhole(name, &camera.pinhole)?;
    for (i, &value) in camera.distortion.coefficients().iter().enumerate() {
        check_finite(&format!("{name}.distortion[{i}]"), value)?;
    }
    Ok(())
}

fn check_pinhole(name: &str, pinhole: &Pinhole) -> Result<(), GeometryError> {
    check_side(&format!("{name}.width_px"), pinhole.width_px)?;
    check_side(&format!("{name}.height_px"), pinhole.height_px)?;
    check_focal(&format!("{name}.fx_px"), pinhole.fx_px)?;
    check_focal(&format!("{name}.fy_px"), pinhole.fy_px)?;
    check_inside(&format!("{name}.cx_px"), pinhole.cx_px, pinhole.width_px)?;
    check_inside(&format!("{name}.cy_px"), pinhole.cy_px, pinhole.height_px)
}

fn check_side(field: &str, side_px: u32) -> Result<(), GeometryError> {
    if (1..=IMAGE_SIDE_MAX_PX).contains(&side_px) {
        return Ok(());
    }
    Err(refused(field, side_px, format!("1 to {IMAGE_SIDE_MAX_PX}")))
}

fn check_focal(field: &str, focal_px: f64) -> Result<(), GeometryError> {
    if focal_px.is_finite() && focal_px > 0.0 {
        return Ok(());
    }
    Err(refused(field, focal_px, "a positive, finite number of pixels".into()))
}

fn check_inside(field: &str, centre_px: f64, side_px: u32) -> Result<(), GeometryError> {
    if (0.0..f64::from(side_px)).contains(&centre_px) {
        return Ok(());
    }
    Err(refused(field, centre_px, format!("inside the image, 0 to {side_px}")))
}

fn check_finite(field: &str, value: f64) -> Result<(), GeometryError> {
    if value.is_finite() {
        return Ok(());
    }
    Err(refused(field, value, "a finite number".into()))
}

fn refused(field: &str, value: impl Into<f64>, requirement: String) -> GeometryError {
    GeometryError::Field { field: field.to_owned(), value: value.into(), requirement }
}
