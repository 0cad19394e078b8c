//! Between wire and domain; nowhere else do the two meet.

use dense::EncodingSteps;
use geometry::validate::{RigLimits, check_calibration, check_rig};
use geometry::{CameraModel, Distortion, Pinhole, Pose, StereoCalibration, StereoRig};
use mis_slam_cart::image_to_wire;
use nalgebra::{Point2, Quaternion, Translation3, UnitQuaternion};
use protocol::v1::{self, ImageFormat, Reason, TrackingOutcome};
use protocol::{NodePosition, NodeTransform, WireSurfel};
use recording::export::PlySurfel;
use recording::{Calibration, RawPixel};
use tracking::{Outcome, TrackedFeature};

use crate::publish::model_lane::{ModelUpdate, NodeChanges, ViewerWishes};
use crate::session::intake::Rejection;
use crate::session::worker::FusedPair;

/// Furthest a quaternion's length may be from 1; seven printed digits give 1e-7.
const UNIT_TOLERANCE: f64 = 1e-4;

/// A calibration that the limits accept.
///
/// # Errors
/// [`Rejection`] that names the field.
pub fn calibration_from_wire(wire: &v1::Calibration, limits: &RigLimits) -> Result<Calibration, Rejection> {
    let calibration = match (&wire.rectified, &wire.raw) {
        (Some(rig), None) => Calibration::Rectified(rig_from_wire(rig)?),
        (None, Some(raw)) => Calibration::Raw(raw_from_wire(raw)?),
        _ => return Err(invalid("exactly one of rectified and raw must be set")),
    };
    match &calibration {
        Calibration::Rectified(rig) => check_rig(rig, limits),
        Calibration::Raw(raw) => check_calibration(raw, limits),
    }
    .map_err(|error| invalid(&error.to_string()))?;
    Ok(calibration)
}

fn invalid(text: &str) -> Rejection {
    Rejection::new(Reason::InvalidCalibration, text)
}

fn required<'a, T>(field: &str, value: Option<&'a T>) -> Result<&'a T, Rejection> {
    value.ok_or_else(|| invalid(&format!("{field} is missing")))
}

fn rig_from_wire(rig: &v1::RectifiedRig) -> Result<StereoRig, Rejection> {
    let left = pinhole_from_wire(required("rectified.left", rig.left.as_ref())?);
    Ok(StereoRig { left, baseline_m: rig.baseline_m, right_cx_px: rig.right_cx_px })
}

fn raw_from_wire(raw: &v1::RawRig) -> Result<StereoCalibration, Rejection> {
    let transform = required("raw.right_from_left", raw.right_from_left.as_ref())?;
    Ok(StereoCalibration {
        left: camera_from_wire("raw.left", raw.left.as_ref())?,
        right: camera_from_wire("raw.right", raw.right.as_ref())?,
        right_from_left: pose_from_wire(transform)
            .ok_or_else(|| invalid("raw.right_from_left has no unit quaternion"))?,
    })
}

fn camera_from_wire(field: &str, camera: Option<&v1::DistortedCamera>) -> Result<CameraModel, Rejection> {
    let camera = required(field, camera)?;
    let pinhole = pinhole_from_wire(required(&format!("{field}.camera"), camera.camera.as_ref())?);
    let distortion = match *camera.distortion {
        [] => Distortion::None,
        [k1, k2, p1, p2, k3] => Distortion::RadialTangential([k1, k2, p1, p2, k3]),
        [k1, k2, p1, p2, k3, k4, k5, k6] => Distortion::Rational([k1, k2, p1, p2, k3, k4, k5, k6]),
        ref other => {
            return Err(invalid(&format!(
                "{field}.distortion has {} values; 0, 5 or 8 are read",
                other.len()
            )));
        }
    };
    Ok(CameraModel { pinhole, distortion })
}

fn pinhole_from_wire(camera: &v1::Camera) -> Pinhole {
    Pinhole {
        width_px: camera.width_px,
        height_px: camera.height_px,
        fx_px: camera.fx_px,
        fy_px: camera.fy_px,
        cx_px: camera.cx_px,
        cy_px: camera.cy_px,
    }
}

/// A pose from the wire; `None` where its quaternion is none.
pub fn pose_from_wire(wire: &v1::RigidTransform) -> Option<Pose> {
    let quaternion = Quaternion::new(wire.qw, wire.qx, wire.qy, wire.qz);
    let unit = (quaternion.norm() - 1.0).abs() < UNIT_TOLERANCE;
    let rotation = unit.then(|| UnitQuaternion::from_quaternion(quaternion))?;
    Some(Pose::from_parts(Translation3::new(wire.tx_m, wire.ty_m, wire.tz_m), rotation))
}

/// A pose on the wire.
pub fn pose_to_wire(pose: &Pose) -> v1::RigidTransform {
    let (t, q) = (&pose.translation, &pose.rotation);
    v1::RigidTransform { tx_m: t.x, ty_m: t.y, tz_m: t.z, qx: q.i, qy: q.j, qz: q.k, qw: q.w }
}

/// A camera on the wire.
pub fn camera_to_wire(camera: &Pinhole) -> v1::Camera {
    let &Pinhole { width_px, height_px, fx_px, fy_px, cx_px, cy_px } = camera;
    v1::Camera { width_px, height_px, fx_px, fy_px, cx_px, cy_px }
}

/// An outcome on the wire.
pub fn outcome_to_wire(outcome: Outcome) -> TrackingOutcome {
    match outcome {
        Outcome::NotInitialized => TrackingOutcome::NotInitialized,
        Outcome::Tracked => TrackingOutcome::Tracked,
        Outcome::Recovered => TrackingOutcome::Recovered,
        Outcome::Lost { .. } => TrackingOutcome::Lost,
    }
}

/// Time since a loss; 0 unless lost.
pub fn lost_for_ns(outcome: Outcome, stamp_ns: u64) -> u64 {
    match outcome {
        Outcome::Lost { since_ns } => stamp_ns.saturating_sub(since_ns),
        _ => 0,
    }
}

/// An image whose header agrees with what the message says of it.
///
/// # Errors
/// [`Rejection`] for a format that is not known.
pub fn image_from_wire(image: v1::EncodedImage) -> Result<recording::EncodedImage, Rejection> {
    let (width, height) = (image.width_px, image.height_px);
    let raw = |pixel: RawPixel| {
        let row_bytes = width.saturating_mul(pixel.bytes());
        recording::ImageFormat::Raw { width, height, row_bytes, pixel }
    };
    let format = match image.format() {
        ImageFormat::Jpeg => recording::ImageFormat::Jpeg,
        ImageFormat::Png => recording::ImageFormat::Png,
        ImageFormat::Rgb8 => raw(RawPixel::Rgb8),
        ImageFormat::Gray8 => raw(RawPixel::Mono8),
        ImageFormat::Unspecified => {
            let text = format!("image format {} is not known", image.format);
            return Err(Rejection::new(Reason::MalformedImage, text));
        }
    };
    Ok(recording::EncodedImage { format, bytes: image.data.into() })
}

/// A pair of a recording on the wire; an image that the wire does not know is left out, and the pair then refused.
pub fn pair_to_wire(message: recording::StereoMessage, sequence: u64, size_px: (u32, u32)) -> v1::StereoPair {
    let image = |image| image_to_wire(image, size_px).ok();
    v1::StereoPair {
        stamp_ns: message.stamp_ns,
        sequence,
        left: image(message.left),
        right: image(message.right),
        mask: message.mask.and_then(image),
    }
}

/// Why a pair was not fused; `None` where it was.
pub fn not_fused(pair: &FusedPair) -> Option<Reason> {
    match (pair.report.fused, pair.world_from_camera) {
        (true, _) => None,
        (false, Some(_)) => Some(Reason::ModelMismatch),
        (false, None) if pair.quality.allows_fusion() => Some(Reason::NotTracked),
        (false, None) => Some(Reason::UnfitPicture),
    }
}

/// A surfel in files; its confidence there is its weight.
pub fn ply_surfel(surfel: &dense::Surfel) -> PlySurfel {
    PlySurfel {
        position: surfel.position,
        normal: surfel.normal,
        color: surfel.color,
        radius_m: surfel.radius_m,
        confidence: surfel.weight,
    }
}

/// A surfel of an exported model, with an id of its own.
pub fn surfel_from_ply((surfel, id): (&PlySurfel, u32)) -> dense::Surfel {
    dense::Surfel {
        id,
        position: surfel.position,
        normal: surfel.normal,
        radius_m: surfel.radius_m,
        weight: surfel.confidence,
        color: surfel.color,
        stamp: 0,
    }
}

/// A JPEG on the wire.
pub fn jpeg_to_wire(image: recording::EncodedImage, (width_px, height_px): (u32, u32)) -> v1::EncodedImage {
    v1::EncodedImage { format: ImageFormat::Jpeg.into(), width_px, height_px, data: image.bytes.into() }
}

/// Steps of a pixel in which features are sent.
const FEATURE_STEPS_PER_PX: f32 = 4.0;

/// What the tracker found in a left image, for those who show it.
pub fn features_to_wire(stamp_ns: u64, features: &[TrackedFeature]) -> v1::ImageFeatures {
    let place = |pixel: &Point2<f32>| {
        [pixel.x, pixel.y].map(|value| (value * FEATURE_STEPS_PER_PX).round().max(0.0) as u32)
    };
    let mut wire = v1::ImageFeatures { stamp_ns, ..v1::ImageFeatures::default() };
    for feature in features {
        let deformed = feature.motion.filter(|motion| !motion.rigid);
        match deformed {
            _ if feature.matched => wire.matched.extend(place(&feature.pixel)),
            Some(motion) => {
                wire.deforming.extend(place(&feature.pixel));
                wire.deforming.extend(place(&motion.previous_pixel));
            }
            None => wire.others.extend(place(&feature.pixel)),
        }
    }
    wire
}

/// What a viewer wants; a gaze that is no place is none.
pub fn wishes_from_wire(view: &v1::View) -> ViewerWishes {
    let place = |gaze: &v1::Point| [gaze.x_m, gaze.y_m, gaze.z_m];
    let gaze = view.gaze_in_world.as_ref().map(place);
    ViewerWishes {
        gaze_in_world_m: gaze.filter(|gaze| gaze.iter().all(|value| value.is_finite())),
        surfels_max: (view.max_surfels > 0).then_some(view.max_surfels as usize),
        bytes_per_s_max: (view.max_bytes_per_s > 0).then_some(view.max_bytes_per_s),
    }
}

/// How finely the protocol encodes what the dense model publishes.
pub const ENCODING: EncodingSteps = EncodingSteps {
    position_m: protocol::POSITION_STEP_M,
    position_max_m: protocol::MAX_POSITION_M,
    node_m: protocol::NODE_STEP_M,
    affine: protocol::AFFINE_STEP,
};

/// A surfel on the wire; confidence is the weight's share of `weight_max`.
pub fn surfel_to_wire(surfel: &dense::Surfel, weight_max: f32) -> WireSurfel {
    WireSurfel {
        id: surfel.id,
        position_in_world_m: surfel.position,
        normal_in_world: surfel.normal,
        radius_m: surfel.radius_m,
        color: surfel.color,
        confidence: surfel.weight / weight_max,
    }
}

/// A change set on the model lane.
pub fn model_update(stamp_ns: u64, changes: &dense::ChangeSet, weight_max: f32) -> ModelUpdate {
    let mut changed: Vec<WireSurfel> = changes
        .added
        .iter()
        .chain(&changes.updated)
        .map(|surfel| surfel_to_wire(surfel, weight_max))
        .collect();
    changed.sort_unstable_by_key(|surfel| surfel.id);
    let warp = &changes.warp;
    let nodes = NodeChanges {
        transforms: warp.transforms.iter().copied().map(NodeTransform).collect(),
        removed: warp.removed.clone(),
        added: warp.added.iter().map(|&(id, place)| (id, NodePosition(place))).collect(),
        reach_m: warp.reach_m,
    };
    let max_error_m = changes.max_error_m;
    ModelUpdate { stamp_ns, changed, removed: changes.removed.clone(), nodes, max_error_m }
}

#[cfg(test)]
mod tests {
    use tracking::FeatureMotion;

    use super::*;

    #[test]
    fn features_are_sent_by_kind_in_quarter_pixels() {
        let feature = |x, y, matched, motion| TrackedFeature {
            pixel: Point2::new(x, y),
            depth_m: None,
            matched,
            track: None,
            motion,
        };
        let moved = FeatureMotion {
            previous_pixel: Point2::new(19.5, 30.0),
            previous_disparity_px: None,
            disparity_px: None,
            rigid: false,
            weight: 1.0,
        };
        let features = [
            feature(10.3, -0.2, true, None),
            feature(30.0, 30.25, false, Some(moved)),
            feature(1.0, 2.0, false, None),
        ];
        let wire = features_to_wire(7, &features);
        assert_eq!((wire.stamp_ns, wire.matched), (7, vec![41, 0]));
        assert_eq!((wire.deforming, wire.others), (vec![120, 121, 78, 120], vec![4, 8]));
    }
}
