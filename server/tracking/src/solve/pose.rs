//! The pose of one camera from points of known position: robust Levenberg-Marquardt over the six pose unknowns.
//!
//! Rounds of optimisation alternate with chi-square classification: each round starts from the last pose, uses only what
//! fitted, and reconsiders everything afterwards (Mur-Artal and Tardos 2017, section IV-D "motion-only BA"). The Huber kernel
//! is dropped in the last round, when outliers are out.

use geometry::{Pose, StereoRig, robust, se3};
use nalgebra::{Matrix3x6, Matrix6, Vector3, Vector6};

use super::reprojection::{PointObservation, inliers, jacobian_pose};
use crate::config::PoseConfig;

/// Damping: start, factors on success and failure.
const DAMPING_START: f64 = 1e-4;
const DAMPING_DOWN: f64 = 0.1;
const DAMPING_UP: f64 = 10.0;
/// Steps with a smaller relative gain end a round.
const GAIN_MIN: f64 = 1e-6;
/// Fewer inliers than unknowns determine nothing.
const INLIERS_MIN: usize = 6;

/// A pose and what supports it.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseEstimate {
    /// The refined pose.
    pub camera_from_world: Pose,
    /// Which observations fit it.
    pub inliers: Vec<bool>,
}

impl PoseEstimate {
    /// Number of observations that fit.
    pub fn inlier_count(&self) -> usize {
        self.inliers.iter().filter(|&&inlier| inlier).count()
    }
}

/// Refines a pose on all observations, inliers and outliers told apart on the way.
pub fn refine_pose(
    rig: &StereoRig,
    start: &Pose,
    points: &[PointObservation],
    config: &PoseConfig,
) -> PoseEstimate {
    let mut camera_from_world = *start;
    let mut used = vec![true; points.len()];
    for round in 0..config.rounds {
        let last = round + 1 == config.rounds;
        let robust = !last || config.rounds == 1;
        camera_from_world = minimise(rig, &camera_from_world, points, &used, robust, config.steps);
        used = inliers(rig, &camera_from_world, points);
        if used.iter().filter(|&&inlier| inlier).count() < INLIERS_MIN {
            break;
        }
    }
    PoseEstimate { camera_from_world, inliers: used }
}

fn minimise(
    rig: &StereoRig,
    start: &Pose,
    points: &[PointObservation],
    used: &[bool],
    robust: bool,
    steps: u32,
) -> Pose {
    let chosen = || points.iter().zip(used).filter(|(_, used)| **used).map(|(point, _)| point);
    let mut pose = *start;
    let mut damping = DAMPING_START;
    let mut system = linearise(rig, &pose, chosen(), robust);
    for _ in 0..steps {
        let Some(step) = damped_step(&system, damping) else { break };
        let candidate = se3::exp(&step) * pose;
        let candidate_system = linearise(rig, &candidate, chosen(), robust);
        let gain = system.cost - candidate_system.cost;
        if gain >= 0.0 {
            let converged = gain <= GAIN_MIN * system.cost;
            (pose, system) = (candidate, candidate_system);
            damping *= DAMPING_DOWN;
            if converged {
                break;
            }
        } else {
            damping *= DAMPING_UP;
        }
    }
    Pose::from_parts(pose.translation, nalgebra::UnitQuaternion::new_normalize(pose.rotation.into_inner()))
}

/// Normal equations `hessian * step = -gradient` and the cost they belong to.
struct System {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
}

fn linearise<'a>(
    rig: &StereoRig,
    camera_from_world: &Pose,
    points: impl Iterator<Item = &'a PointObservation>,
    robust: bool,
) -> System {
    let mut system = System { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), cost: 0.0 };
    let rotation = camera_from_world.rotation.to_rotation_matrix();
    for PointObservation { point_in_world, observation, trust } in points {
        let point_in_camera = rotation * point_in_world + camera_from_world.translation.vector;
        let information = 1.0 / (observation.sigma_px * observation.sigma_px);
        let limit = observation.chi2_limit();
        let Some(residual) = observation.residual(rig, &point_in_camera) else {
            system.cost += trust * limit;
            continue;
        };
        let chi2 = residual.norm_squared() * information;
        let weighted = if robust {
            robust::huber(chi2, limit.sqrt())
        } else {
            robust::RobustCost { cost: chi2, weight: 1.0 }
        };
        let jacobian = jacobian_pose(&observation.jacobian_point(rig, &point_in_camera), &point_in_camera);
        add_normal_equations(&mut system, &jacobian, &residual, trust * weighted.weight * information);
        system.cost += trust * weighted.cost;
    }
    system.hessian.fill_lower_triangle_with_upper_triangle();
    system
}

/// Adds `weight * J^T J`, its upper triangle only, and `weight * J^T r`; by plain loops, which are several times as fast as
/// products of matrices of this size.
#[inline(always)]
fn add_normal_equations(
    system: &mut System,
    jacobian: &Matrix3x6<f64>,
    residual: &Vector3<f64>,
    weight: f64,
) {
    for column in 0..6 {
        let weighted: [f64; 3] = std::array::from_fn(|row| weight * jacobian[(row, column)]);
        for other in 0..=column {
            let product = |row: usize| weighted[row] * jacobian[(row, other)];
            system.hessian[(other, column)] += product(0) + product(1) + product(2);
        }
        let product = |row: usize| weighted[row] * residual[row];
        system.gradient[column] += product(0) + product(1) + product(2);
    }
}

fn damped_step(system: &System, damping: f64) -> Option<Vector6<f64>> {
    let mut damped = system.hessian;
    for i in 0..6 {
        damped[(i, i)] += damping * system.hessian[(i, i)].max(f64::MIN_POSITIVE);
    }
    let step = -damped.cholesky()?.solve(&system.gradient);
    step.iter().all(|value| value.is_finite()).then_some(step)
}
