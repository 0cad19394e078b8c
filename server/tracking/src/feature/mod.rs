//! Oriented FAST corners with rotated BRIEF descriptors (Rublee et al. 2011), spread evenly over an image pyramid.

pub mod brief;
pub mod distribution;
pub mod extract;
pub mod fast;
pub mod grid;
pub mod orientation;
pub mod pyramid;
pub mod smooth;
pub mod validity;

pub use brief::Descriptor;
pub use extract::{Extractor, Features};
pub use pyramid::Pyramid;
pub use validity::ValidityMap;

use nalgebra::Point2;

/// Pixels between a keypoint and its level's border: the orientation disc and the rotated descriptor stay inside.
pub const BORDER_PX: u32 = 17;

/// An oriented corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Where, in pixels of the full-size image.
    pub pixel: Point2<f32>,
    /// Pyramid level that it was found on.
    pub level: u8,
    /// Direction from the corner to its patch's centre of mass, `(-pi, pi]`, x towards y.
    pub angle_rad: f32,
    /// FAST score: grey levels of contrast.
    pub score: u8,
}
