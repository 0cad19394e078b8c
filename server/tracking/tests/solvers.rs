//! Solvers against synthetic truth: derivatives, outliers, noise.

mod support;

use geometry::{Pose, StereoRig, se3};
use nalgebra::{Point2, Point3, Vector3, Vector6};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use support::{config, rig};
use tracking::solve::absolute_pose::find_pose;
use tracking::solve::pose::refine_pose;
use tracking::solve::reprojection::{Observation, PointObservation, jacobian_pose, project};
use tracking::solve::structure::{Sighting, refine_point};

fn truth() -> Pose {
    se3::exp(&Vector6::new(0.01, -0.02, 0.015, 0.1, -0.15, 0.3))
}

fn noise(random: &mut Pcg64Mcg, sigma: f64) -> f64 {
    // a sum of uniform numbers is near enough to Gaussian here
    sigma * (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>()
}

fn observe(
    rig: &StereoRig,
    point_in_camera: &Point3<f64>,
    random: &mut Pcg64Mcg,
    sigma_px: f64,
) -> Observation {
    let seen = project(rig, point_in_camera);
    let mut noisy = |value: f64| value + noise(random, sigma_px);
    let pixel = Point2::new(noisy(seen.x), noisy(seen.y));
    Observation { pixel, right_x_px: Some(noisy(seen.z)), sigma_px: 1.0 }
}

/// `count` points in view of the true pose, the first `outliers` of them seen somewhere else.
fn scene(count: usize, outliers: usize, seed: u128) -> Vec<PointObservation> {
    let (rig, mut random) = (rig(), Pcg64Mcg::new(seed));
    (0..count)
        .map(|index| {
            let pixel = Point2::new(random.random_range(0.0..319.0), random.random_range(0.0..239.0));
            let point_in_camera = rig.left.back_project(&pixel, random.random_range(0.05..0.12));
            let mut observation = observe(&rig, &point_in_camera, &mut random, 0.5);
            if index < outliers {
                let jump = Vector3::from_fn(|_, _| random.random_range(-60.0..60.0));
                observation.pixel += jump.xy();
                observation.right_x_px = observation.right_x_px.map(|right| right + jump.x + 0.3 * jump.z);
            }
            PointObservation { point_in_world: truth().inverse() * point_in_camera, observation, trust: 1.0 }
        })
        .collect()
}

fn error_mm_and_mrad(estimate: &Pose) -> (f64, f64) {
    let error = se3::log(&(estimate * truth().inverse())) * 1e3;
    (error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm())
}

#[test]
fn jacobians_agree_with_finite_differences() {
    let (rig, mut random) = (rig(), Pcg64Mcg::new(1));
    for mono in [false, true] {
        for _ in 0..20 {
            let point = Point3::new(
                random.random_range(-0.04..0.04),
                random.random_range(-0.03..0.03),
                random.random_range(0.04..0.15),
            );
            let right_x_px = (!mono).then_some(100.0);
            let observation = Observation { pixel: Point2::new(160.0, 120.0), right_x_px, sigma_px: 1.0 };
            let residual = |point: &Point3<f64>| observation.residual(&rig, point).expect("in front");
            let by_point = observation.jacobian_point(&rig, &point);
            let by_pose = jacobian_pose(&by_point, &point);
            for axis in 0..6 {
                let mut step = Vector6::zeros();
                step[axis] = 1e-7;
                let moved = |sign: f64| residual(&(se3::exp(&(step * sign)) * point));
                let numeric = (moved(1.0) - moved(-1.0)) / 2e-7;
                let error = (numeric - by_pose.column(axis)).norm();
                assert!(error < 1e-5 * (1.0 + numeric.norm()), "axis {axis}: {error}");
                if axis < 3 {
                    assert!((numeric - by_point.column(axis)).norm() < 1e-5 * (1.0 + numeric.norm()));
                }
            }
        }
    }
}

#[test]
fn a_pose_is_refined_to_its_noise_with_a_third_of_outliers() {
    for seed in 0..5 {
        let points = scene(300, 100, seed);
        let start = se3::exp(&Vector6::new(0.003, -0.002, 0.002, 0.01, 0.015, -0.02)) * truth();
        let estimate = refine_pose(&rig(), &start, &points, &config().pose);
        let (translation_mm, rotation_mrad) = error_mm_and_mrad(&estimate.camera_from_world);
        assert!(translation_mm < 0.15 && rotation_mrad < 1.5, "{translation_mm} mm, {rotation_mrad} mrad");
        assert!(estimate.inliers[100..].iter().filter(|&&inlier| inlier).count() > 190);
        assert!(estimate.inliers[..100].iter().filter(|&&inlier| inlier).count() < 8);
    }
}

#[test]
fn trusted_points_outvote_a_majority_that_moved() {
    let mut points = scene(300, 0, 3);
    for point in &mut points[..200] {
        point.observation.pixel.x += 1.5;
        point.observation.right_x_px = point.observation.right_x_px.map(|right| right + 1.5);
        point.trust = 0.05;
    }
    let estimate = refine_pose(&rig(), &truth(), &points, &config().pose);
    let (_, with_trust_mrad) = error_mm_and_mrad(&estimate.camera_from_world);
    points.iter_mut().for_each(|point| point.trust = 1.0);
    let (_, without_mrad) =
        error_mm_and_mrad(&refine_pose(&rig(), &truth(), &points, &config().pose).camera_from_world);
    assert!(with_trust_mrad < 0.5 * without_mrad, "{with_trust_mrad} mrad with, {without_mrad} mrad without");
}

#[test]
fn a_pose_is_found_without_a_guess_among_sixty_percent_outliers() {
    for seed in 0..5 {
        let points = scene(200, 120, 20 + seed);
        let estimate = find_pose(&rig(), &points, &config().pose, &config().recovery).expect("a pose");
        let (translation_mm, rotation_mrad) = error_mm_and_mrad(&estimate.camera_from_world);
        assert!(translation_mm < 0.5 && rotation_mrad < 5.0, "{translation_mm} mm, {rotation_mrad} mrad");
        assert_eq!(find_pose(&rig(), &points, &config().pose, &config().recovery), Some(estimate));
    }
}

#[test]
fn no_pose_is_found_in_noise() {
    let points = scene(200, 200, 40);
    let mut recovery = config().recovery;
    recovery.first_inliers_min = 30;
    assert_eq!(find_pose(&rig(), &points, &config().pose, &recovery), None);
    assert_eq!(find_pose(&rig(), &[], &config().pose, &recovery), None);
}

#[test]
fn a_point_seen_from_five_places_is_placed_better_than_by_one() {
    let (rig, mut random) = (rig(), Pcg64Mcg::new(60));
    let poses: Vec<Pose> = (0..5)
        .map(|i| se3::exp(&Vector6::new(0.004 * f64::from(i), 0.002, 0.0, 0.0, 0.03 * f64::from(i), 0.0)))
        .collect();
    let (mut single, mut refined) = (0.0, 0.0);
    for _ in 0..50 {
        let point = Point3::new(random.random_range(-0.01..0.02), random.random_range(-0.02..0.02), 0.08);
        let sightings: Vec<Sighting> = poses
            .iter()
            .map(|pose| Sighting {
                camera_from_world: pose,
                observation: observe(&rig, &(pose * point), &mut random, 0.4),
            })
            .collect();
        let first = geometry::triangulate::stereo(
            &rig,
            &sightings[0].observation.pixel,
            sightings[0].observation.right_x_px.expect("stereo"),
        );
        let start = poses[0].inverse() * first.expect("in front");
        single += (start - point).norm_squared();
        refined += (refine_point(&rig, &start, &sightings).expect("determined") - point).norm_squared();
    }
    assert!(refined < 0.15 * single, "mean squared error {refined} after {single}");
}
