//! The normal equations of a bundle, block by block: `[H_cc W; W' H_pp] [xi; d] = -[g_c; g_p]`.

use geometry::{StereoRig, robust};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

use super::{Bundle, BundlePoint, BundleSighting};
use crate::solve::reprojection::jacobian_pose;

/// Curvature and slope of the cost at the present poses and points.
pub(super) struct NormalEquations {
    /// Place of each camera's six unknowns among the free cameras; `None` for fixed ones.
    pub free: Vec<Option<usize>>,
    /// Diagonal blocks and slopes of the free cameras.
    pub cameras: Vec<(Matrix6<f64>, Vector6<f64>)>,
    /// Blocks of the points.
    pub points: Vec<PointBlock>,
}

/// What one point contributes.
pub(super) struct PointBlock {
    /// Curvature.
    pub hessian: Matrix3<f64>,
    /// Slope.
    pub gradient: Vector3<f64>,
    /// The blocks of `W` with the free cameras that see it.
    pub coupling: Vec<(usize, Matrix6x3<f64>)>,
}

impl NormalEquations {
    pub fn of(bundle: &Bundle, rig: &StereoRig) -> Self {
        let mut count = 0;
        let free: Vec<Option<usize>> = bundle
            .cameras
            .iter()
            .map(|camera| {
                let place = (!camera.fixed).then_some(count);
                count += usize::from(!camera.fixed);
                place
            })
            .collect();
        let mut equations =
            Self { free, cameras: vec![(Matrix6::zeros(), Vector6::zeros()); count], points: Vec::new() };
        equations.points.reserve(bundle.points.len());
        for point in &bundle.points {
            let block = equations.add_point(bundle, rig, point);
            equations.points.push(block);
        }
        equations
    }

    fn add_point(&mut self, bundle: &Bundle, rig: &StereoRig, point: &BundlePoint) -> PointBlock {
        let mut block =
            PointBlock { hessian: Matrix3::zeros(), gradient: Vector3::zeros(), coupling: Vec::new() };
        for sighting in point.sightings.iter().filter(|sighting| sighting.used) {
            self.add_sighting(bundle, rig, (point, sighting), &mut block);
        }
        block
    }

    fn add_sighting(
        &mut self,
        bundle: &Bundle,
        rig: &StereoRig,
        (point, sighting): (&BundlePoint, &BundleSighting),
        block: &mut PointBlock,
    ) {
        let camera_from_world = &bundle.cameras[sighting.camera].camera_from_world;
        let observation = &sighting.observation;
        let rotation = camera_from_world.rotation.to_rotation_matrix();
        let point_in_camera = rotation * point.position_in_world + camera_from_world.translation.vector;
        let Some(residual) = observation.residual(rig, &point_in_camera) else { return };
        let information = 1.0 / (observation.sigma_px * observation.sigma_px);
        let chi2 = residual.norm_squared() * information;
        let weight = point.trust * information * robust::huber(chi2, observation.chi2_limit().sqrt()).weight;
        let in_camera = observation.jacobian_point(rig, &point_in_camera);
        let by_point = in_camera * rotation.matrix();
        block.hessian += by_point.tr_mul(&by_point) * weight;
        block.gradient += by_point.tr_mul(&residual) * weight;
        if let Some(place) = self.free[sighting.camera] {
            let by_pose = jacobian_pose(&in_camera, &point_in_camera);
            let weighted = by_pose * weight;
            let (hessian, gradient) = &mut self.cameras[place];
            *hessian += weighted.tr_mul(&by_pose);
            *gradient += weighted.tr_mul(&residual);
            block.coupling.push((place, weighted.tr_mul(&by_point)));
        }
    }
}
