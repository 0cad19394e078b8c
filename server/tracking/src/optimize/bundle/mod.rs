//! Bundle adjustment: camera poses and point positions from all sightings at once (Triggs et al. 2000).
//!
//! Minimises `sum_ij trust_j rho(|r_ij|^2 / sigma_ij^2)` over poses `T_i` and points `X_j`, `r_ij` the stereo or monocular
//! reprojection residual of [`crate::solve::reprojection`], `rho` Huber's. Unknowns are `xi_i` (6, left update `exp(xi_i) T_i`)
//! and `d_j` (3). Levenberg-Marquardt: each step solves the damped normal equations by the Schur complement
//! over the points ([`reduced`]), and is kept only if it lowers the cost, so the cost never rises.

mod linearise;
mod reduced;

use geometry::{Pose, StereoRig, robust, se3};
use nalgebra::{Point3, UnitQuaternion, Vector6};

use crate::solve::reprojection::Observation;
use linearise::NormalEquations;

/// Damping: start, factors on success and failure, and where no step can be expected any more.
const DAMPING_START: f64 = 1e-4;
const DAMPING_DOWN: f64 = 0.1;
const DAMPING_UP: f64 = 10.0;
const DAMPING_MAX: f64 = 1e6;
/// Steps with a smaller relative gain end the descent.
const GAIN_MIN: f64 = 1e-4;

/// A camera of the bundle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BundleCamera {
    /// Its pose.
    pub camera_from_world: Pose,
    /// Whether the pose is taken as true.
    pub fixed: bool,
}

/// Who saw a point, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BundleSighting {
    /// Index of the camera.
    pub camera: usize,
    /// What it saw.
    pub observation: Observation,
    /// Whether it counts: outliers do not.
    pub used: bool,
}

/// A point of the bundle.
#[derive(Clone, Debug, PartialEq)]
pub struct BundlePoint {
    /// Where it is.
    pub position_in_world: Point3<f64>,
    /// Factor on the information of its sightings.
    pub trust: f64,
    /// Its sightings.
    pub sightings: Vec<BundleSighting>,
}

/// Cameras, points and what ties them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bundle {
    /// Cameras; at least one should be fixed, or the world may drift.
    pub cameras: Vec<BundleCamera>,
    /// Points.
    pub points: Vec<BundlePoint>,
}

/// How a descent went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    /// Cost before.
    pub cost_before: f64,
    /// Cost after: never more.
    pub cost_after: f64,
    /// Steps taken, refused ones not counted.
    pub steps: u32,
}

impl Bundle {
    /// The cost of all used sightings; infinite where one lies behind its camera.
    pub fn cost(&self, rig: &StereoRig) -> f64 {
        let of_point = |point: &BundlePoint| -> f64 {
            let used = point.sightings.iter().filter(|sighting| sighting.used);
            used.map(|sighting| point.trust * self.sighting_cost(rig, point, sighting)).sum()
        };
        self.points.iter().map(of_point).sum()
    }

    fn sighting_cost(&self, rig: &StereoRig, point: &BundlePoint, sighting: &BundleSighting) -> f64 {
        let camera_from_world = &self.cameras[sighting.camera].camera_from_world;
        let observation = &sighting.observation;
        let chi2 = observation.chi2(rig, &(camera_from_world * point.position_in_world));
        robust::huber(chi2, observation.chi2_limit().sqrt()).cost
    }

    /// Marks the sightings that fit, and only those, as used; gives the number of the others.
    pub fn classify(&mut self, rig: &StereoRig) -> usize {
        let mut outliers = 0;
        for point in &mut self.points {
            for sighting in &mut point.sightings {
                let camera_from_world = &self.cameras[sighting.camera].camera_from_world;
                let point_in_camera = camera_from_world * point.position_in_world;
                sighting.used = sighting.observation.fits(rig, &point_in_camera);
                outliers += usize::from(!sighting.used);
            }
        }
        outliers
    }

    /// At most `steps_max` Levenberg-Marquardt steps on the used sightings, none of which may raise the cost.
    pub fn minimise(&mut self, rig: &StereoRig, steps_max: u32) -> Descent {
        let cost_before = self.cost(rig);
        let mut descent = Descent { cost_before, cost_after: cost_before, steps: 0 };
        let mut damping = DAMPING_START;
        while descent.steps < steps_max && cost_before.is_finite() && damping <= DAMPING_MAX {
            let equations = NormalEquations::of(self, rig);
            let Some((candidate, cost)) = self.lower(rig, &equations, &mut damping, descent.cost_after)
            else {
                break;
            };
            let gain = descent.cost_after - cost;
            let converged = gain <= GAIN_MIN * descent.cost_after;
            (*self, descent.cost_after) = (candidate, cost);
            descent.steps += 1;
            if converged {
                break;
            }
        }
        descent
    }

    /// The bundle after a step that lowers the cost, damped as much as that takes; `None` where none does.
    fn lower(
        &self,
        rig: &StereoRig,
        equations: &NormalEquations,
        damping: &mut f64,
        cost_before: f64,
    ) -> Option<(Self, f64)> {
        while *damping <= DAMPING_MAX {
            if let Some(step) = reduced::solve(self, equations, *damping) {
                let candidate = self.moved(&step);
                let cost = candidate.cost(rig);
                if cost < cost_before {
                    *damping *= DAMPING_DOWN;
                    return Some((candidate, cost));
                }
            }
            *damping *= DAMPING_UP;
        }
        None
    }

    fn moved(&self, step: &reduced::Step) -> Self {
        let mut moved = self.clone();
        for (camera, tangent) in moved.cameras.iter_mut().zip(&step.cameras) {
            if let Some(tangent) = tangent {
                camera.camera_from_world = updated(&camera.camera_from_world, tangent);
            }
        }
        for (point, offset) in moved.points.iter_mut().zip(&step.points) {
            point.position_in_world += offset;
        }
        moved
    }
}

/// `exp(tangent) * pose`, its quaternion brought back to length one.
fn updated(pose: &Pose, tangent: &Vector6<f64>) -> Pose {
    let pose = se3::exp(tangent) * pose;
    Pose::from_parts(pose.translation, UnitQuaternion::new_normalize(pose.rotation.into_inner()))
}
