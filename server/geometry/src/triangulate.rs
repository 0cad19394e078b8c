//! Points from pixels seen twice or more.

use nalgebra::{Matrix3, Point2, Point3, Unit, Vector3};

use crate::StereoRig;

/// Rays whose normal matrix has a smaller determinant per ray are parallel to double precision (about 1e-5 rad).
const PARALLEL_DETERMINANT: f64 = 1e-10;

/// A half line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The optical centre.
    pub origin: Point3<f64>,
    /// Where it looks.
    pub direction: Unit<Vector3<f64>>,
}

/// The point in the left camera frame of a rectified match: left pixel, right column.
///
/// `None` where the disparity is not that of a finite point in front of the cameras.
pub fn stereo(rig: &StereoRig, left_pixel: &Point2<f64>, right_x_px: f64) -> Option<Point3<f64>> {
    let depth_m = rig.depth_m(left_pixel.x - right_x_px);
    (depth_m.is_finite() && depth_m > 0.0).then(|| rig.left.back_project(left_pixel, depth_m))
}

/// The point nearest to all rays (least sum of squared distances), in the frame of the rays.
///
/// `None` for fewer than two rays, parallel rays, and points behind any origin.
pub fn midpoint(rays: &[Ray]) -> Option<Point3<f64>> {
    let mut normal_matrix = Matrix3::zeros();
    let mut right_side = Vector3::zeros();
    for ray in rays {
        let across = Matrix3::identity() - ray.direction.into_inner() * ray.direction.transpose();
        normal_matrix += across;
        right_side += across * ray.origin.coords;
    }
    let count = rays.len() as f64;
    if normal_matrix.determinant() <= PARALLEL_DETERMINANT * count.powi(3) {
        return None;
    }
    let point = Point3::from(normal_matrix.cholesky()?.solve(&right_side));
    let in_front = |ray: &Ray| (point - ray.origin).dot(&ray.direction) > 0.0;
    rays.iter().all(in_front).then_some(point)
}
