//! The position of one point from several sightings by cameras of known pose: robust Gauss-Newton over three unknowns.

use geometry::{Pose, StereoRig, robust};
use nalgebra::{Matrix3, Point3, Vector3};

use super::reprojection::Observation;

const STEPS: usize = 4;
/// Relative to the point's depth.
const CONVERGED_SHARE: f64 = 1e-5;

/// A sighting and the camera that made it.
#[derive(Clone, Copy, Debug)]
pub struct Sighting<'a> {
    /// The camera's pose.
    pub camera_from_world: &'a Pose,
    /// What it saw.
    pub observation: Observation,
}

/// The point that best explains its sightings, from a first position; `None` where they do not determine it.
pub fn refine_point(rig: &StereoRig, start: &Point3<f64>, sightings: &[Sighting]) -> Option<Point3<f64>> {
    let mut point_in_world = *start;
    for _ in 0..STEPS {
        let (mut hessian, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
        let mut depth_m = f64::INFINITY;
        for Sighting { camera_from_world, observation } in sightings {
            let point_in_camera = *camera_from_world * point_in_world;
            let Some(residual) = observation.residual(rig, &point_in_camera) else { continue };
            let information = 1.0 / (observation.sigma_px * observation.sigma_px);
            let chi2 = residual.norm_squared() * information;
            let weight = information * robust::huber(chi2, observation.chi2_limit().sqrt()).weight;
            let rotation = camera_from_world.rotation.to_rotation_matrix();
            let jacobian = observation.jacobian_point(rig, &point_in_camera) * rotation.matrix();
            hessian += jacobian.tr_mul(&jacobian) * weight;
            gradient += jacobian.tr_mul(&residual) * weight;
            depth_m = depth_m.min(point_in_camera.z);
        }
        let step = hessian.cholesky()?.solve(&gradient);
        point_in_world -= step;
        if step.norm() <= CONVERGED_SHARE * depth_m {
            break;
        }
    }
    point_in_world.coords.iter().all(|value| value.is_finite()).then_some(point_in_world)
}
