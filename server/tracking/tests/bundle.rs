//! Bundle adjustment against synthetic truth.

mod support;

use geometry::{Pose, se3};
use nalgebra::{Point2, Point3, Vector3, Vector6};
use proptest::prelude::*;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use support::rig;
use tracking::optimize::bundle::{Bundle, BundleCamera, BundlePoint, BundleSighting};
use tracking::solve::reprojection::{Observation, project};

/// How a bundle is to be made.
#[derive(Clone, Copy, Debug)]
struct Scene {
    cameras: usize,
    points: usize,
    noise_px: f64,
    /// Share of the sightings that are somewhere else.
    outliers: f64,
    /// Share of the sightings without a right column.
    mono: f64,
    /// Disturbance of poses (m, rad) and points (m) at the start.
    disturbance: f64,
    seed: u64,
}

const SCENE: Scene =
    Scene { cameras: 6, points: 150, noise_px: 0.0, outliers: 0.0, mono: 0.3, disturbance: 2e-3, seed: 1 };

fn tangent(random: &mut Pcg64Mcg, size: f64) -> Vector6<f64> {
    Vector6::from_fn(|_, _| size * random.random_range(-1.0..1.0))
}

/// The truth and the same disturbed; the first two cameras are fixed and true.
fn bundles(scene: Scene) -> (Bundle, Bundle) {
    let rig = rig();
    let mut random = Pcg64Mcg::new(u128::from(scene.seed));
    let cameras: Vec<BundleCamera> = (0..scene.cameras)
        .map(|index| BundleCamera {
            camera_from_world: se3::exp(&tangent(&mut random, 0.01)),
            fixed: index < 2,
        })
        .collect();
    let points = (0..scene.points).map(|_| {
        let pixel = Point2::new(random.random_range(60.0..260.0), random.random_range(50.0..190.0));
        let position_in_world = rig.left.back_project(&pixel, random.random_range(0.06..0.1));
        let sightings = (0..scene.cameras)
            .map(|camera| {
                let seen = project(&rig, &(cameras[camera].camera_from_world * position_in_world));
                let far = random.random_bool(scene.outliers);
                let spread = if far { 40.0 } else { scene.noise_px };
                let seen = seen + Vector3::from_fn(|_, _| spread * random.random_range(-1.0..1.0));
                let observation = Observation {
                    pixel: Point2::new(seen.x, seen.y),
                    right_x_px: (!random.random_bool(scene.mono)).then_some(seen.z),
                    sigma_px: 0.5,
                };
                BundleSighting { camera, observation, used: true }
            })
            .collect();
        BundlePoint { position_in_world, trust: random.random_range(0.1..1.0), sightings }
    });
    let truth = Bundle { points: points.collect(), cameras: cameras.clone() };
    let mut start = truth.clone();
    for camera in start.cameras.iter_mut().filter(|camera| !camera.fixed) {
        camera.camera_from_world =
            se3::exp(&tangent(&mut random, scene.disturbance)) * camera.camera_from_world;
    }
    for point in &mut start.points {
        point.position_in_world +=
            Vector3::from_fn(|_, _| scene.disturbance * random.random_range(-1.0..1.0));
    }
    (truth, start)
}

fn worst_pose_error(a: &Bundle, b: &Bundle) -> f64 {
    let error = |(a, b): (&BundleCamera, &BundleCamera)| {
        se3::log(&(a.camera_from_world * b.camera_from_world.inverse())).norm()
    };
    a.cameras.iter().zip(&b.cameras).map(error).fold(0.0, f64::max)
}

#[test]
fn without_noise_the_truth_is_found() {
    let (truth, mut bundle) = bundles(SCENE);
    let descent = bundle.minimise(&rig(), 30);
    assert!(descent.cost_after < 1e-9 * descent.cost_before, "{descent:?}");
    assert!(worst_pose_error(&bundle, &truth) < 1e-6, "{}", worst_pose_error(&bundle, &truth));
}

#[test]
fn with_noise_the_start_does_not_matter_and_fixed_cameras_stay() {
    let (truth, mut bundle) = bundles(Scene { noise_px: 0.5, ..SCENE });
    let mut from_truth = truth.clone();
    bundle.minimise(&rig(), 30);
    from_truth.minimise(&rig(), 30);
    let (error, least) = (worst_pose_error(&bundle, &truth), worst_pose_error(&from_truth, &truth));
    assert!(worst_pose_error(&bundle, &from_truth) < 0.1 * least, "{error}, from the truth {least}");
    assert_eq!(bundle.cameras[..2], truth.cameras[..2]);
}

#[test]
fn outliers_are_told_apart_and_then_do_no_harm() {
    let (truth, mut bundle) = bundles(Scene { noise_px: 0.3, outliers: 0.15, ..SCENE });
    for _ in 0..3 {
        bundle.minimise(&rig(), 10);
        bundle.classify(&rig());
    }
    let outliers = bundle.classify(&rig());
    let sightings = SCENE.cameras * SCENE.points;
    assert!((outliers as f64 / sightings as f64 - 0.15).abs() < 0.05, "{outliers} of {sightings}");
    assert!(worst_pose_error(&bundle, &truth) < 2e-3, "{}", worst_pose_error(&bundle, &truth));
}

#[test]
fn a_bundle_of_fixed_cameras_moves_its_points_alone() {
    let (truth, mut bundle) = bundles(Scene { disturbance: 1e-3, ..SCENE });
    bundle.cameras.clone_from(&truth.cameras);
    for camera in &mut bundle.cameras {
        camera.fixed = true;
    }
    bundle.minimise(&rig(), 30);
    let far = bundle
        .points
        .iter()
        .zip(&truth.points)
        .map(|(a, b)| (a.position_in_world - b.position_in_world).norm());
    assert!(far.fold(0.0, f64::max) < 1e-6);
}

#[test]
fn the_step_follows_the_slope_of_the_cost() {
    // one tiny step along each unknown, by the cost itself: the minimum found is flat in all of them
    let (_, mut bundle) = bundles(Scene { noise_px: 0.5, points: 40, ..SCENE });
    bundle.minimise(&rig(), 60);
    let cost = bundle.cost(&rig());
    for axis in 0..6 {
        for sign in [-1.0, 1.0] {
            let mut moved = bundle.clone();
            let mut tangent = Vector6::zeros();
            tangent[axis] = sign * 1e-5;
            moved.cameras[3].camera_from_world = se3::exp(&tangent) * moved.cameras[3].camera_from_world;
            assert!(moved.cost(&rig()) > cost * (1.0 - 1e-9), "pose axis {axis}");
        }
    }
    for axis in 0..3 {
        let mut moved = bundle.clone();
        moved.points[7].position_in_world[axis] += 1e-6;
        assert!(moved.cost(&rig()) > cost * (1.0 - 1e-9), "point axis {axis}");
    }
}

#[test]
fn a_point_behind_a_camera_stops_the_descent_and_nothing_else() {
    let (_, mut bundle) = bundles(SCENE);
    bundle.points[0].position_in_world = Point3::new(0.0, 0.0, -0.1);
    let before = bundle.clone();
    assert_eq!(bundle.minimise(&rig(), 5).steps, 0);
    assert_eq!(bundle, before);
    bundle.classify(&rig());
    let descent = bundle.minimise(&rig(), 5);
    assert!(descent.cost_after < descent.cost_before);
}

#[test]
fn nothing_is_adjusted_where_nothing_is() {
    let mut empty = Bundle::default();
    assert_eq!(empty.minimise(&rig(), 5).cost_after, 0.0);
    let mut alone = Bundle {
        cameras: vec![BundleCamera { camera_from_world: Pose::identity(), fixed: false }],
        points: Vec::new(),
    };
    alone.minimise(&rig(), 5);
    assert_eq!(alone.cameras[0].camera_from_world, Pose::identity());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bundle_adjustment_never_raises_its_cost(
        cameras in 2_usize..7,
        points in 1_usize..60,
        noise_px in 0.0..20.0,
        outliers in 0.0..0.6,
        mono in 0.0..1.0,
        disturbance in 0.0..0.05,
        seed in any::<u64>(),
    ) {
        let scene = Scene { cameras, points, noise_px, outliers, mono, disturbance, seed };
        let (_, mut bundle) = bundles(scene);
        let mut last = bundle.cost(&rig());
        for _ in 0..6 {
            let descent = bundle.minimise(&rig(), 1);
            prop_assert!(descent.cost_before.to_bits() == last.to_bits());
            prop_assert!(descent.cost_after <= descent.cost_before);
            prop_assert!(bundle.cost(&rig()).to_bits() == descent.cost_after.to_bits());
            last = descent.cost_after;
        }
    }
}
