//! When a tracked frame becomes a keyframe.

use geometry::Pose;

use crate::config::MapConfig;
use crate::map::Keyframe;
use crate::report::KeyframeReason;

/// A tracked frame as the rule sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrackedFrame {
    pub(super) camera_from_world: Pose,
    pub(super) inliers: usize,
    pub(super) median_depth_m: Option<f64>,
    pub(super) frames_since_keyframe: u32,
}

/// Compares a frame with its reference keyframe.
pub(super) fn reason(
    frame: &TrackedFrame,
    reference: &Keyframe,
    config: &MapConfig,
) -> Option<KeyframeReason> {
    if frame.frames_since_keyframe < config.frames_between_min {
        return None;
    }
    let motion = frame.camera_from_world * reference.camera_from_world.inverse();
    let far = frame
        .median_depth_m
        .is_some_and(|depth_m| motion.translation.vector.norm() > config.motion_max_depth_share * depth_m);
    if (frame.inliers as f64) < config.tracked_share_min * reference.point_count() as f64 {
        Some(KeyframeReason::FewTracked)
    } else if far {
        Some(KeyframeReason::Motion)
    } else if motion.rotation.angle() > config.rotation_max_deg.to_radians() {
        Some(KeyframeReason::Rotation)
    } else {
        None
    }
}
