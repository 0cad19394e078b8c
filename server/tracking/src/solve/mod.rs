//! Poses and points from matches, by least squares.

pub mod absolute_pose;
pub mod alignment;
pub mod pose;
pub mod reprojection;
pub mod standstill;
pub mod stereo_drift;
pub mod structure;
