//! What is known beside the images.

use geometry::DepthMap;
use nalgebra::Point3;

/// A depth map of the left rectified view at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedDepth {
    /// Time of the image that it belongs to.
    pub stamp_ns: u64,
    /// Metres along the optical axis, 0 = unknown.
    pub depth: DepthMap,
}

/// Where material points are at one time; `ids` and `points_in_world` go together.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthPoints {
    /// Time of the image that they belong to.
    pub stamp_ns: u64,
    /// Stable names of the points.
    pub ids: Vec<u32>,
    /// Their places, metres.
    pub points_in_world: Vec<Point3<f64>>,
}
