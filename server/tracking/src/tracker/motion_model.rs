//! Constant velocity.

use geometry::{Pose, se3};
use nalgebra::Vector6;

use crate::local_mapping::PosedFrame;

/// Motion of the camera in its own frame, tangent vector per nanosecond.
#[derive(Clone, Copy, Debug)]
pub(super) struct Velocity(Vector6<f64>);

impl Velocity {
    /// Between two tracked frames, the second one later.
    pub(super) fn between(before: &PosedFrame, after: &PosedFrame) -> Self {
        let motion = after.camera_from_world * before.camera_from_world.inverse();
        Self(se3::log(&motion) / (after.stamp_ns - before.stamp_ns) as f64)
    }
}

/// `camera_from_world` at a later time; the last pose where the velocity is not known.
pub(super) fn predict(last: &PosedFrame, velocity: Option<&Velocity>, stamp_ns: u64) -> Pose {
    let elapsed_ns = (stamp_ns - last.stamp_ns) as f64;
    velocity.map_or(last.camera_from_world, |Velocity(per_ns)| {
        se3::exp(&(per_ns * elapsed_ns)) * last.camera_from_world
    })
}
