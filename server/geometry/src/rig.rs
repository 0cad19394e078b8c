//! The rectified stereo rig that every later stage works in.

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

/// A pinhole camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pinhole {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Focal length along x.
    pub fx_px: f64,
    /// Focal length along y.
    pub fy_px: f64,
    /// Principal point, x.
    pub cx_px: f64,
    /// Principal point, y.
    pub cy_px: f64,
}

impl Pinhole {
    /// The pixel of a point in the camera frame; meaningless for `z <= 0`.
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Point2<f64> {
        let inv_z = 1.0 / point_in_camera.z;
        Point2::new(
            self.fx_px * point_in_camera.x * inv_z + self.cx_px,
            self.fy_px * point_in_camera.y * inv_z + self.cy_px,
        )
    }

    /// The point in the camera frame at a pixel and a depth along the optical axis.
    pub fn back_project(&self, pixel: &Point2<f64>, depth_m: f64) -> Point3<f64> {
        Point3::new(
            (pixel.x - self.cx_px) / self.fx_px * depth_m,
            (pixel.y - self.cy_px) / self.fy_px * depth_m,
            depth_m,
        )
    }
}

/// Two rectified cameras: rows correspond, the right camera lies at `+baseline_m` on the left one's x axis.
///
/// The right camera shares focal lengths, `cy` and size with the left; its own `cx` may differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StereoRig {
    /// The left camera, the reference.
    pub left: Pinhole,
    /// Distance of the optical centres.
    pub baseline_m: f64,
    /// The right camera's principal point, x.
    pub right_cx_px: f64,
}

impl StereoRig {
    /// Depth of a disparity `u_left - u_right`; infinite or negative where there is none.
    pub fn depth_m(&self, disparity_px: f64) -> f64 {
        self.left.fx_px * self.baseline_m / (disparity_px - self.disparity_at_infinity_px())
    }

    /// Disparity `u_left - u_right` of a depth.
    pub fn disparity_px(&self, depth_m: f64) -> f64 {
        self.left.fx_px * self.baseline_m / depth_m + self.disparity_at_infinity_px()
    }

    /// `cx_left - cx_right`, the disparity of infinitely far points.
    pub fn disparity_at_infinity_px(&self) -> f64 {
        self.left.cx_px - self.right_cx_px
    }
}
