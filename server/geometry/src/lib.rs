//! Cameras, stereo rigs, rectification, rigid motion, images and trajectories.
//!
//! Conventions: metres, seconds, radians, nanosecond stamps; transforms are named `target_from_source`;
//! camera frames are x right, y down, z forward; pixel centres are at integers.

mod camera;
mod distortion;
mod error;
mod raster;
mod rectification;
mod remap;
mod rig;
pub mod robust;
pub mod se3;
pub mod trajectory;
pub mod triangulate;
pub mod validate;
pub mod viewpoint;

pub use camera::{CameraModel, StereoCalibration};
pub use distortion::Distortion;
pub use error::GeometryError;
pub use raster::{DepthMap, Gray, Mask, Raster, Rgb};
pub use rectification::{Eye, Rectification};
pub use rig::{Pinhole, StereoRig};
pub use validate::RigLimits;

/// A rigid transform, named `target_from_source` wherever it is held.
pub type Pose = nalgebra::Isometry3<f64>;
