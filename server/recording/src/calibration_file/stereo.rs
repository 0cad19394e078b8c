//! Two cameras and the motion between them, from the numbers that files give.

use geometry::{CameraModel, Distortion, Pinhole, Pose, StereoCalibration};
use nalgebra::{Translation3, UnitQuaternion};

use super::numbers::exactly;
use crate::calibration::distortion;
use crate::rotation::rotation_from_rows;

/// Coefficients of OpenCV's rational model; what follows are thin prisms and tilts.
const RATIONAL: usize = 8;

/// A camera's numbers with the names that its file gives them.
pub(super) struct CameraNumbers<'a> {
    pub size_px: (u32, u32),
    /// Name and rows of the 3x3 intrinsic matrix.
    pub intrinsic: (&'a str, [f64; 9]),
    /// Name and coefficients of the lens, in OpenCV's order.
    pub distortion: (&'a str, &'a [f64]),
}

/// The camera, with the field named that no camera has.
pub(super) fn camera(numbers: &CameraNumbers<'_>) -> Result<CameraModel, String> {
    let (name, [fx_px, skew, cx_px, _, fy_px, cy_px, ..]) = numbers.intrinsic;
    for (field, value) in [("fx", fx_px), ("fy", fy_px)] {
        // Written so that a NaN is refused too.
        if !(value > 0.0 && value.is_finite()) {
            return Err(format!("{name}: {field} = {value}, it must be above 0"));
        }
    }
    for (field, value, most) in [("cx", cx_px, numbers.size_px.0), ("cy", cy_px, numbers.size_px.1)] {
        if !(0.0..f64::from(most)).contains(&value) {
            return Err(format!("{name}: {field} = {value} is outside the image of {most} px"));
        }
    }
    if skew.abs() > 1e-6 * fx_px {
        return Err(format!("{name}: skew {skew}; cameras with skew are not read"));
    }
    let (width_px, height_px) = numbers.size_px;
    let pinhole = Pinhole { width_px, height_px, fx_px, fy_px, cx_px, cy_px };
    Ok(CameraModel { pinhole, distortion: lens(numbers.distortion)? })
}

/// A lens by the number of its coefficients, as OpenCV tells its models apart.
fn lens((name, coefficients): (&str, &[f64])) -> Result<Distortion, String> {
    if let Some(value) = coefficients.iter().find(|value| !value.is_finite()) {
        return Err(format!("{name} holds {value}"));
    }
    if coefficients.iter().skip(RATIONAL).any(|&value| value != 0.0) {
        return Err(format!("{name}: thin prisms and tilts (coefficients 9 to 14) are not read"));
    }
    let (model, used) = match coefficients.len() {
        0..=RATIONAL if coefficients.iter().skip(5).all(|&value| value == 0.0) => {
            ("plumb_bob", &coefficients[..coefficients.len().min(5)])
        }
        RATIONAL | 12 | 14 => ("rational_polynomial", &coefficients[..RATIONAL]),
        count => return Err(format!("{name} has {count} coefficients; 4, 5, 8, 12 and 14 are read")),
    };
    distortion(model, used).map_err(|(_, problem)| format!("{name}: {problem}"))
}

/// The motion that takes points of the left camera to the right one; `names` are those of rotation and translation.
pub(super) fn right_from_left(
    names: [&str; 2],
    rotation: &[f64],
    translation: &[f64],
    unit_m: f64,
) -> Result<Pose, String> {
    let rows: [f64; 9] = exactly(names[0], rotation)?;
    let rotation =
        rotation_from_rows(&rows).ok_or_else(|| format!("{} = {rows:?} is no rotation", names[0]))?;
    motion(names[1], rotation, exactly(names[1], translation)?.map(|value| value * unit_m))
}

/// As [`right_from_left`], in metres.
pub(super) fn motion(name: &str, rotation: UnitQuaternion<f64>, [x, y, z]: [f64; 3]) -> Result<Pose, String> {
    let pose = Pose::from_parts(Translation3::new(x, y, z), rotation);
    let right_in_left = pose.inverse().translation.vector;
    if right_in_left.norm() == 0.0 {
        return Err(format!("{name} = 0: the cameras are at one place"));
    }
    if right_in_left.x < 0.0 {
        return Err(format!(
            "{name} = [{x}, {y}, {z}] m: the right camera is on the left; are the eyes swapped?"
        ));
    }
    Ok(pose)
}

/// Both cameras, of one size.
pub(super) fn rig(
    left: CameraModel,
    right: CameraModel,
    right_from_left: Pose,
) -> Result<crate::Calibration, String> {
    let [l, r] = [&left.pinhole, &right.pinhole].map(|pinhole| (pinhole.width_px, pinhole.height_px));
    if l != r {
        return Err(format!("the right image is {}x{}, the left one {}x{}", r.0, r.1, l.0, l.1));
    }
    Ok(crate::Calibration::Raw(StereoCalibration { left, right, right_from_left }))
}
