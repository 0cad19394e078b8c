//! Between the calibration messages of two cameras and a rig.
//!
//! A message carries the intrinsic matrix `K` and distortion `D` of the image as it is, the rotation `R` into the
//! rectified frame, and the projection `P` of the rectified image, with `P[3] = -fx * baseline_m` on the right.
//! Together the two give the motion between the cameras: a point `x` of the left camera is, in the right one,
//! `R_right^T (R_left x + [P_right[3] / P_right[0], 0, 0])`.

use geometry::{CameraModel, Distortion, Eye, Pinhole, Pose, Rectification, StereoCalibration, StereoRig};
use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::RecordingError;
use crate::rotation::rotation_from_rows;

/// Largest entry of `R - I` that still counts as no rotation: 1e-9 rad moves no pixel of any image.
const ROTATION_TOLERANCE: f64 = 1e-9;
/// Largest relative difference of focal lengths, and difference (px) of `cy`, between rectified cameras.
const SAME_CAMERA_TOLERANCE: f64 = 1e-6;

/// The calibration of a recording's images.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a session holds one; a box would cost it being plain data")]
pub enum Calibration {
    /// The images are rectified.
    Rectified(StereoRig),
    /// The images are as the cameras gave them.
    Raw(StereoCalibration),
}

impl Calibration {
    /// Columns and rows of the left images.
    pub fn image_size_px(&self) -> (u32, u32) {
        let pinhole = match self {
            Self::Rectified(rig) => &rig.left,
            Self::Raw(calibration) => &calibration.left.pinhole,
        };
        (pinhole.width_px, pinhole.height_px)
    }
}

/// The content of one calibration message, whatever its encoding.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CameraRecord {
    pub width: u32,
    pub height: u32,
    pub distortion_model: String,
    pub d: Vec<f64>,
    pub k: [f64; 9],
    pub r: [f64; 9],
    pub p: [f64; 12],
}

/// A calibration message's field that makes no sense.
#[derive(Debug, PartialEq)]
pub(crate) struct FieldProblem {
    pub eye: Eye,
    pub field: String,
    pub problem: String,
}

/// The rig or raw calibration that two messages describe.
pub(crate) fn from_records(left: &CameraRecord, right: &CameraRecord) -> Result<Calibration, FieldProblem> {
    if is_rectified(left) && is_rectified(right) {
        return rectified(left, right).map(Calibration::Rectified);
    }
    let rotation = |record: &CameraRecord, eye| {
        rotation(&record.r).map_err(|problem| FieldProblem { eye, field: "R".into(), problem })
    };
    let model = |record: &CameraRecord, eye| {
        camera_model(record).map_err(|(field, problem)| FieldProblem { eye, field, problem })
    };
    let rectified_from_left = rotation(left, Eye::Left)?;
    let right_from_rectified = rotation(right, Eye::Right)?.inverse();
    let shift = Vector3::new(right.p[3] / right.p[0], 0.0, 0.0);
    Ok(Calibration::Raw(StereoCalibration {
        left: model(left, Eye::Left)?,
        right: model(right, Eye::Right)?,
        right_from_left: Pose::from_parts(
            Translation3::from(right_from_rectified * shift),
            right_from_rectified * rectified_from_left,
        ),
    }))
}

/// The two messages, left and right, of a calibration.
pub(crate) fn to_records(calibration: &Calibration) -> Result<[CameraRecord; 2], RecordingError> {
    match calibration {
        Calibration::Rectified(rig) => {
            let plain = Pose::identity();
            let right = Pinhole { cx_px: rig.right_cx_px, ..rig.left };
            let records = [(rig.left, 0.0), (right, rig.baseline_m)];
            Ok(records.map(|(pinhole, baseline_m)| {
                record(&CameraModel { pinhole, distortion: Distortion::None }, &plain, &pinhole, baseline_m)
            }))
        }
        Calibration::Raw(raw) => {
            let rectification = Rectification::from_calibration(raw)?;
            let rig = rectification.rig();
            let rotation = |eye| rectification.rectified_from_raw(eye);
            Ok([
                record(&raw.left, &rotation(Eye::Left), &rig.left, 0.0),
                record(&raw.right, &rotation(Eye::Right), &rig.left, rig.baseline_m),
            ])
        }
    }
}

fn is_rectified(record: &CameraRecord) -> bool {
    let identity = Matrix3::<f64>::identity();
    let turned = Matrix3::from_row_slice(&record.r) - identity;
    record.d.iter().all(|&k| k == 0.0) && (turned.amax() <= ROTATION_TOLERANCE || is_unset(&record.r))
}

/// Zeros stand for "not calibrated" in ROS and for an empty field in protobuf.
fn is_unset(matrix: &[f64; 9]) -> bool {
    matrix.iter().all(|&value| value == 0.0)
}

fn rectified(left: &CameraRecord, right: &CameraRecord) -> Result<StereoRig, FieldProblem> {
    let refused = |eye, field: &str, problem| Err(FieldProblem { eye, field: field.into(), problem });
    for (field, l, r) in [("width", left.width, right.width), ("height", left.height, right.height)] {
        if l != r {
            return refused(Eye::Right, field, format!("{r}, but {l} on the left"));
        }
    }
    let same = |l: f64, r: f64| (l - r).abs() <= SAME_CAMERA_TOLERANCE * l.abs().max(1.0);
    for (index, name) in [(0, "P[0] (fx)"), (5, "P[5] (fy)"), (6, "P[6] (cy)")] {
        if !same(left.p[index], right.p[index]) {
            let problem =
                format!("{} but {} on the left, in rectified images", right.p[index], left.p[index]);
            return refused(Eye::Right, name, problem);
        }
    }
    if right.p[3] == 0.0 {
        return refused(
            Eye::Right,
            "P[3]",
            "0, so the baseline is unknown (it must be -fx * baseline)".into(),
        );
    }
    let left_pinhole = Pinhole {
        width_px: left.width,
        height_px: left.height,
        fx_px: left.p[0],
        fy_px: left.p[5],
        cx_px: left.p[2],
        cy_px: left.p[6],
    };
    Ok(StereoRig { left: left_pinhole, baseline_m: -right.p[3] / right.p[0], right_cx_px: right.p[2] })
}

fn camera_model(record: &CameraRecord) -> Result<CameraModel, (String, String)> {
    let [fx_px, _, cx_px, _, fy_px, cy_px, ..] = record.k;
    let pinhole = Pinhole { width_px: record.width, height_px: record.height, fx_px, fy_px, cx_px, cy_px };
    Ok(CameraModel { pinhole, distortion: distortion(&record.distortion_model, &record.d)? })
}

/// The lens of a distortion model's name and coefficients, in OpenCV's order.
pub(crate) fn distortion(model: &str, d: &[f64]) -> Result<Distortion, (String, String)> {
    if d.iter().all(|&k| k == 0.0) {
        return Ok(Distortion::None);
    }
    match (model, d) {
        ("plumb_bob" | "radial-tangential" | "radtan", &[k1, k2, p1, p2]) => {
            Ok(Distortion::RadialTangential([k1, k2, p1, p2, 0.0]))
        }
        ("plumb_bob" | "radial-tangential" | "radtan", &[k1, k2, p1, p2, k3]) => {
            Ok(Distortion::RadialTangential([k1, k2, p1, p2, k3]))
        }
        ("rational_polynomial", &[k1, k2, p1, p2, k3, k4, k5, k6]) => {
            Ok(Distortion::Rational([k1, k2, p1, p2, k3, k4, k5, k6]))
        }
        ("plumb_bob" | "radial-tangential" | "radtan" | "rational_polynomial", _) => {
            Err(("D".into(), format!("{} coefficients do not fit the model {model:?}", d.len())))
        }
        _ => Err((
            "distortion_model".into(),
            format!("{model:?} is not read; plumb_bob and rational_polynomial are"),
        )),
    }
}

fn rotation(r: &[f64; 9]) -> Result<UnitQuaternion<f64>, String> {
    if is_unset(r) {
        return Ok(UnitQuaternion::identity());
    }
    rotation_from_rows(r).ok_or_else(|| format!("{r:?} is no rotation"))
}

fn record(
    camera: &CameraModel,
    rectified_from_raw: &Pose,
    rectified: &Pinhole,
    baseline_m: f64,
) -> CameraRecord {
    let raw = &camera.pinhole;
    let r = rectified_from_raw.rotation.to_rotation_matrix().into_inner().transpose();
    let Pinhole { fx_px, fy_px, cx_px, cy_px, .. } = *rectified;
    // Not `-fx * 0`: a negative zero reads badly.
    let shift = if baseline_m == 0.0 { 0.0 } else { -fx_px * baseline_m };
    CameraRecord {
        width: raw.width_px,
        height: raw.height_px,
        distortion_model: match camera.distortion {
            Distortion::None => "",
            Distortion::RadialTangential(_) => "plumb_bob",
            Distortion::Rational(_) => "rational_polynomial",
        }
        .to_owned(),
        d: camera.distortion.coefficients().to_vec(),
        k: [raw.fx_px, 0.0, raw.cx_px, 0.0, raw.fy_px, raw.cy_px, 0.0, 0.0, 1.0],
        r: std::array::from_fn(|i| r.as_slice()[i]),
        p: [fx_px, 0.0, cx_px, shift, 0.0, fy_px, cy_px, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectified_records() -> [CameraRecord; 2] {
        let left =
            Pinhole { width_px: 640, height_px: 480, fx_px: 520.0, fy_px: 521.0, cx_px: 320.0, cy_px: 240.0 };
        to_records(&Calibration::Rectified(StereoRig { left, baseline_m: 0.005, right_cx_px: 318.0 }))
            .unwrap()
    }

    fn refused(change: impl Fn(&mut CameraRecord)) -> FieldProblem {
        let [left, mut right] = rectified_records();
        change(&mut right);
        from_records(&left, &right).unwrap_err()
    }

    #[test]
    fn a_rotation_left_out_or_zero_means_rectified() {
        let [mut left, right] = rectified_records();
        left.r = [0.0; 9];
        left.d = vec![0.0; 5];
        assert!(matches!(from_records(&left, &right), Ok(Calibration::Rectified(_))));
    }

    #[test]
    fn a_rectified_pair_that_does_not_agree_names_the_field() {
        assert_eq!(refused(|right| right.p[0] = 519.0).field, "P[0] (fx)");
        assert_eq!(refused(|right| right.p[6] = f64::NAN).field, "P[6] (cy)");
        assert_eq!(refused(|right| right.p[3] = 0.0).field, "P[3]");
        assert_eq!(refused(|right| right.width = 320).field, "width");
    }

    #[test]
    fn a_lens_that_is_not_read_names_the_field() {
        let lens = |model: &str, count| {
            let model = model.to_owned();
            refused(move |right| (right.distortion_model, right.d) = (model.clone(), vec![0.1; count]))
        };
        assert_eq!(lens("equidistant", 4).field, "distortion_model");
        assert_eq!(lens("plumb_bob", 8).field, "D");
        assert_eq!(lens("rational_polynomial", 5).field, "D");
        assert_eq!(refused(|right| right.r = [1.0; 9]).field, "R");
    }

    #[test]
    fn swapped_eyes_show_as_a_negative_baseline() {
        let [left, mut right] = rectified_records();
        right.p[3] = -right.p[3];
        let Ok(Calibration::Rectified(rig)) = from_records(&left, &right) else { panic!("not rectified") };
        assert!((rig.baseline_m + 0.005).abs() < 1e-15);
    }
}
