//! Cameras, stereo rigs, rectification, rigid motion, images and trajectories.
//!
//! Conventions: metres, seconds, radians, nanosecond stamps; transforms are named `target_from_source`;
//! camera frames are x right, y down, z forward; pixel centres are at integers.

mod error;
mod raster;
mod rig;

pub use error::GeometryError;
pub use raster::{DepthMap, Gray, Mask, Raster, Rgb};
pub use rig::{Pinhole, StereoRig};

/// A rigid transform, named `target_from_source` wherever it is held.
pub type Pose = nalgebra::Isometry3<f64>;
