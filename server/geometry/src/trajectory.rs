//! Stamped poses and how well one trajectory follows another.

mod align;
mod associate;
mod metrics;

pub use align::{Scale, Similarity, umeyama};
pub use associate::{Association, Clock, associate};
pub use metrics::{AbsoluteError, RelativeError, ate, path_length_m, pose_error, rpe};

use crate::Pose;

/// A camera's place at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPose {
    /// Time of the image.
    pub stamp_ns: u64,
    /// Takes points of the camera frame to the world.
    pub world_from_camera: Pose,
}
