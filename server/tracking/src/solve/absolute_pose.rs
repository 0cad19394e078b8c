//! A camera's pose without a first guess: RANSAC (Fischler and Bolles 1981) over triples of points whose depth the stereo rig
//! measured, aligned in closed form and judged by reprojection, which knows how uncertain far points are.

use geometry::{Pose, StereoRig};
use nalgebra::Point3;
use rand::seq::index;
use rand_pcg::Pcg64Mcg;

use super::alignment::align;
use super::pose::{PoseEstimate, refine_pose};
use super::reprojection::PointObservation;
use crate::config::{PoseConfig, RecoveryConfig};

/// Every call draws the same samples.
const SEED: u128 = 0x5eed_0f5a_3131_e500;

/// The pose that most observations agree on, refined; `None` where fewer than `first_inliers_min` do.
///
/// All are taken to be `sigma_factor` times as uncertain as features are: between views so far apart tissue has moved.
pub fn find_pose(
    rig: &StereoRig,
    points: &[PointObservation],
    pose_config: &PoseConfig,
    config: &RecoveryConfig,
) -> Option<PoseEstimate> {
    let mut points = points.to_vec();
    for point in &mut points {
        point.observation.sigma_px *= config.sigma_factor;
    }
    let best = best_sample(rig, &points, config)?;
    let estimate = refine_pose(rig, &best, &points, pose_config);
    (estimate.inlier_count() >= config.first_inliers_min as usize).then_some(estimate)
}

fn best_sample(rig: &StereoRig, points: &[PointObservation], config: &RecoveryConfig) -> Option<Pose> {
    let with_depth: Vec<(Point3<f64>, Point3<f64>)> =
        points.iter().filter_map(|point| Some((point.point_in_world, measured_point(rig, point)?))).collect();
    if with_depth.len() < 3 {
        return None;
    }
    let mut random = Pcg64Mcg::new(SEED);
    let mut best: Option<(f64, Pose)> = None;
    let mut samples_wanted = config.ransac_samples_max;
    let mut samples = 0;
    while samples < samples_wanted {
        samples += 1;
        let chosen = index::sample(&mut random, with_depth.len(), 3);
        let triple: [(Point3<f64>, Point3<f64>); 3] = std::array::from_fn(|i| with_depth[chosen.index(i)]);
        let Some(pose) = align(&triple.map(|pair| pair.0), &triple.map(|pair| pair.1)) else { continue };
        let (cost, inlier_share) = truncated_cost(rig, &pose, points);
        if best.as_ref().is_none_or(|(lowest, _)| cost < *lowest) {
            best = Some((cost, pose));
            samples_wanted = samples_wanted.min(samples_needed(inlier_share, config.ransac_confidence));
        }
    }
    best.map(|(_, pose)| pose)
}

/// The point in the camera as the rig measured it.
fn measured_point(rig: &StereoRig, point: &PointObservation) -> Option<Point3<f64>> {
    geometry::triangulate::stereo(rig, &point.observation.pixel, point.observation.right_x_px?)
}

/// Sum of squared residuals cut off at the chi-square limit (MSAC, Torr and Zisserman 2000), and the share below it.
fn truncated_cost(rig: &StereoRig, camera_from_world: &Pose, points: &[PointObservation]) -> (f64, f64) {
    let (mut cost, mut inliers) = (0.0, 0);
    for point in points {
        let limit = point.observation.chi2_limit();
        let chi2 = point.observation.chi2(rig, &(camera_from_world * point.point_in_world));
        inliers += usize::from(chi2 < limit);
        cost += chi2.min(limit);
    }
    (cost, inliers as f64 / points.len() as f64)
}

/// Samples after which three inliers were drawn at once with the given confidence.
fn samples_needed(inlier_share: f64, confidence: f64) -> u32 {
    let all_good = inlier_share.powi(3);
    if all_good >= 1.0 {
        return 1;
    }
    let needed = (1.0 - confidence).ln() / (1.0 - all_good).ln();
    if needed.is_finite() { needed.ceil().min(f64::from(u32::MAX)) as u32 } else { u32::MAX }
}
