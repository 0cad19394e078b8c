//! The stereo reprojection residual and its derivatives.
//!
//! A point `X` in the world is `p = camera_from_world * X = (x, y, z)`; the rectified rig sees it at
//! `u_l = fx x/z + cx`, `v = fy y/z + cy`, `u_r = fx (x - b)/z + cx_r`. The residual is observed minus predicted,
//! `(u_l, v, u_r)` in px; its third entry is absent (zero) where the right camera has no match. Poses are updated from
//! the left, `exp(xi) * camera_from_world` with `xi = [rho; phi]`, so `dp/dxi = [I | -skew(p)]`, and `dp/dX = R`.

use geometry::{Pose, StereoRig, robust};
use nalgebra::{Matrix3, Matrix3x6, Point2, Point3, Vector3};

/// One sighting of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Left pixel.
    pub pixel: Point2<f64>,
    /// Right column, where matched.
    pub right_x_px: Option<f64>,
    /// Standard deviation of each entry, px.
    pub sigma_px: f64,
}

/// A point of known position and where it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointObservation {
    /// Where it is.
    pub point_in_world: Point3<f64>,
    /// Where it was seen.
    pub observation: Observation,
    /// Factor on its information: less than 1 for points that may have moved.
    pub trust: f64,
}

impl Observation {
    /// 95 % quantile of the squared whitened residual: three degrees of freedom with stereo, else two.
    pub fn chi2_limit(&self) -> f64 {
        if self.right_x_px.is_some() { robust::CHI2_95_3DOF } else { robust::CHI2_95_2DOF }
    }

    /// Observed minus predicted, px; `None` for points not in front of the camera.
    pub fn residual(&self, rig: &StereoRig, point_in_camera: &Point3<f64>) -> Option<Vector3<f64>> {
        if point_in_camera.z.is_nan() || point_in_camera.z <= MIN_DEPTH_M {
            return None;
        }
        let predicted = project(rig, point_in_camera);
        let right = self.right_x_px.map_or(0.0, |observed| observed - predicted.z);
        Some(Vector3::new(self.pixel.x - predicted.x, self.pixel.y - predicted.y, right))
    }

    /// Squared whitened residual; infinite for points not in front of the camera.
    pub fn chi2(&self, rig: &StereoRig, point_in_camera: &Point3<f64>) -> f64 {
        self.residual(rig, point_in_camera)
            .map_or(f64::INFINITY, |residual| residual.norm_squared() / (self.sigma_px * self.sigma_px))
    }

    /// Squared whitened residual per degree of freedom, 1 on average for Gaussian noise of `sigma_px`.
    pub fn misfit(&self, rig: &StereoRig, point_in_camera: &Point3<f64>) -> f64 {
        let degrees_of_freedom = if self.right_x_px.is_some() { 3.0 } else { 2.0 };
        self.chi2(rig, point_in_camera) / degrees_of_freedom
    }

    /// Whether the whitened residual passes the chi-square test.
    pub fn fits(&self, rig: &StereoRig, point_in_camera: &Point3<f64>) -> bool {
        robust::is_inlier(self.chi2(rig, point_in_camera), self.chi2_limit())
    }

    /// Derivative of the residual with respect to the point in the camera.
    pub fn jacobian_point(&self, rig: &StereoRig, point_in_camera: &Point3<f64>) -> Matrix3<f64> {
        let (fx, fy) = (rig.left.fx_px, rig.left.fy_px);
        let inv_z = 1.0 / point_in_camera.z;
        let (x, y) = (point_in_camera.x * inv_z, point_in_camera.y * inv_z);
        let stereo = if self.right_x_px.is_some() { 1.0 } else { 0.0 };
        let right_x = (point_in_camera.x - rig.baseline_m) * inv_z;
        -inv_z * Matrix3::new(fx, 0.0, -fx * x, 0.0, fy, -fy * y, stereo * fx, 0.0, -stereo * fx * right_x)
    }
}

/// Points nearer than this are not in front of any camera.
const MIN_DEPTH_M: f64 = 1e-6;

/// `(u_l, v, u_r)` of a point in front of the camera.
pub fn project(rig: &StereoRig, point_in_camera: &Point3<f64>) -> Vector3<f64> {
    let left = rig.left.project(point_in_camera);
    Vector3::new(left.x, left.y, left.x - rig.disparity_px(point_in_camera.z))
}

/// Derivative of a residual with respect to the pose's tangent, from that with respect to the point in the camera.
pub fn jacobian_pose(jacobian_point: &Matrix3<f64>, point_in_camera: &Point3<f64>) -> Matrix3x6<f64> {
    let mut jacobian = Matrix3x6::zeros();
    jacobian.fixed_columns_mut::<3>(0).copy_from(jacobian_point);
    let rotation = -jacobian_point * point_in_camera.coords.cross_matrix();
    jacobian.fixed_columns_mut::<3>(3).copy_from(&rotation);
    jacobian
}

/// Marks the observations that fit a pose.
pub fn inliers(rig: &StereoRig, camera_from_world: &Pose, points: &[PointObservation]) -> Vec<bool> {
    let fits =
        |point: &PointObservation| point.observation.fits(rig, &(camera_from_world * point.point_in_world));
    points.iter().map(fits).collect()
}
