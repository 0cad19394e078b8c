//! Exponential and logarithm of rigid motions.
//!
//! A tangent vector is `[rho; phi]`, three translations (m), then three rotations (rad). Updates multiply from
//! the left, `exp(xi) * pose`, so `xi` lives in the *target* frame of a `target_from_source` pose.
//!
//! With `K = skew(phi)`, `theta = |phi|`, the left Jacobian of SO(3) is
//! `V = I + (1 - cos theta)/theta^2 K + (theta - sin theta)/theta^3 K^2` and `exp([rho; phi]) = (exp(phi), V rho)`
//! (Barfoot, *State Estimation for Robotics*, section 7.1).

use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::Pose;

/// Below this angle (rad) the coefficients come from their series; both forms agree to 1e-16 there.
const SMALL_ANGLE_RAD: f64 = 1e-3;

/// The rigid motion of a tangent vector `[rho; phi]`.
pub fn exp(tangent: &Vector6<f64>) -> Pose {
    let rho = tangent.fixed_rows::<3>(0).into_owned();
    let phi = tangent.fixed_rows::<3>(3).into_owned();
    let translation = left_jacobian_so3(&phi) * rho;
    Pose::from_parts(Translation3::from(translation), UnitQuaternion::from_scaled_axis(phi))
}

/// The tangent vector `[rho; phi]` of a rigid motion, `|phi| <= pi`.
///
/// At exactly half a turn both signs of `phi` are right; either may come.
pub fn log(pose: &Pose) -> Vector6<f64> {
    let phi = pose.rotation.scaled_axis();
    let rho = left_jacobian_so3_inverse(&phi) * pose.translation.vector;
    Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
}

/// The matrix of the cross product, `skew(a) * b = a x b`.
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    v.cross_matrix()
}

/// Left Jacobian of SO(3): `exp(phi + d) = exp(left_jacobian_so3(phi) * d) * exp(phi)` to first order in `d`.
pub fn left_jacobian_so3(phi: &Vector3<f64>) -> Matrix3<f64> {
    let theta = phi.norm();
    let theta2 = theta * theta;
    let (b, c) = if theta < SMALL_ANGLE_RAD {
        (0.5 - theta2 / 24.0, 1.0 / 6.0 - theta2 / 120.0)
    } else {
        ((1.0 - theta.cos()) / theta2, (theta - theta.sin()) / (theta2 * theta))
    };
    let k = skew(phi);
    Matrix3::identity() + k * b + k * k * c
}

/// Inverse of [`left_jacobian_so3`], finite up to a full turn.
pub fn left_jacobian_so3_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    let theta = phi.norm();
    let theta2 = theta * theta;
    let d = if theta < SMALL_ANGLE_RAD {
        1.0 / 12.0 + theta2 / 720.0
    } else {
        let half = 0.5 * theta;
        (1.0 - half * half.cos() / half.sin()) / theta2
    };
    let k = skew(phi);
    Matrix3::identity() - k * 0.5 + k * k * d
}
