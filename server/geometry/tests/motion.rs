//! Exponential, logarithm and triangulation by their properties.

use std::f64::consts::PI;

use geometry::triangulate::{Ray, midpoint, stereo};
use geometry::{Pinhole, StereoRig, se3};
use nalgebra::{Matrix4, Point2, Point3, Unit, Vector3, Vector6};
use proptest::prelude::*;

const RIG: StereoRig = StereoRig {
    left: Pinhole { width_px: 640, height_px: 480, fx_px: 520.0, fy_px: 525.0, cx_px: 319.0, cy_px: 241.0 },
    baseline_m: 0.005,
    right_cx_px: 330.0,
};

/// `exp` as the matrix series, the definition.
fn exp_by_series(tangent: &Vector6<f64>) -> Matrix4<f64> {
    let mut generator = Matrix4::zeros();
    generator.fixed_view_mut::<3, 3>(0, 0).copy_from(&se3::skew(&tangent.fixed_rows::<3>(3).into_owned()));
    generator.fixed_view_mut::<3, 1>(0, 3).copy_from(&tangent.fixed_rows::<3>(0));
    let mut term = Matrix4::identity();
    let mut sum = term;
    for order in 1..60 {
        term = term * generator / f64::from(order);
        sum += term;
    }
    sum
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64]
        .prop_map(Vector3::from)
        .prop_filter_map("no direction", |v| v.try_normalize(1e-3))
}

fn angle_rad() -> impl Strategy<Value = f64> {
    prop_oneof![
        0.0..PI,
        (0.0..12.0f64).prop_map(|digits| 10f64.powf(-digits)),
        (3.0..9.0f64).prop_map(|digits| PI - 10f64.powf(-digits)),
        Just(0.0),
        Just(0.999e-3),
        Just(1.001e-3),
    ]
}

fn tangent() -> impl Strategy<Value = Vector6<f64>> {
    ([-2.0..2.0f64, -2.0..2.0f64, -2.0..2.0f64], direction(), angle_rad()).prop_map(|(rho, axis, angle)| {
        let phi = axis * angle;
        Vector6::new(rho[0], rho[1], rho[2], phi.x, phi.y, phi.z)
    })
}

#[test]
fn half_a_turn_survives_logarithm_and_exponential() {
    let half_turn = se3::exp(&Vector6::new(0.1, -0.2, 0.3, 0.0, PI, 0.0));
    let back = se3::exp(&se3::log(&half_turn));
    assert!((back.to_homogeneous() - half_turn.to_homogeneous()).abs().max() < 1e-12);
}

#[test]
fn rays_that_do_not_meet_give_no_point() {
    let forward = Vector3::z_axis();
    let ray = |x, direction| Ray { origin: Point3::new(x, 0.0, 0.0), direction };
    assert_eq!(midpoint(&[ray(0.0, forward)]), None, "one ray");
    assert_eq!(midpoint(&[ray(0.0, forward), ray(0.1, forward)]), None, "parallel");
    let apart = Unit::new_normalize(Vector3::new(0.1, 0.0, 1.0));
    assert_eq!(midpoint(&[ray(0.0, forward), ray(0.1, apart)]), None, "they meet behind");
}

#[test]
fn a_disparity_of_infinity_or_beyond_gives_no_point() {
    let infinity_px = RIG.disparity_at_infinity_px();
    let pixel = Point2::new(100.0, 50.0);
    for disparity_px in [infinity_px, infinity_px - 3.0, f64::NAN] {
        assert_eq!(stereo(&RIG, &pixel, pixel.x - disparity_px), None, "{disparity_px} px");
    }
}

proptest! {
    #[test]
    fn exponential_is_the_matrix_series(tangent in tangent()) {
        let difference = se3::exp(&tangent).to_homogeneous() - exp_by_series(&tangent);
        prop_assert!(difference.abs().max() < 1e-12, "{difference}");
    }

    #[test]
    fn logarithm_inverts_exponential(tangent in tangent()) {
        let back = se3::log(&se3::exp(&tangent));
        prop_assert!((back - tangent).norm() < 1e-8, "{back} for {tangent}");
    }

    #[test]
    fn the_left_jacobian_carries_small_turns(axis in direction(), angle in angle_rad(), step in direction()) {
        let phi = axis * angle;
        let step = step * 1e-6;
        let turn = |phi: Vector3<f64>| nalgebra::Rotation3::from_scaled_axis(phi);
        let moved = turn(se3::left_jacobian_so3(&phi) * step) * turn(phi);
        let expected = turn(phi + step);
        prop_assert!((moved.matrix() - expected.matrix()).abs().max() < 1e-11);
        let identity = se3::left_jacobian_so3(&phi) * se3::left_jacobian_so3_inverse(&phi);
        prop_assert!((identity - nalgebra::Matrix3::identity()).abs().max() < 1e-9);
    }

    #[test]
    fn a_stereo_match_gives_back_its_point(x in -0.5..0.5f64, y in -0.4..0.4f64, z in 0.01..2.0f64) {
        let point = Point3::new(x * z, y * z, z);
        let left = RIG.left.project(&point);
        let found = stereo(&RIG, &left, left.x - RIG.disparity_px(z)).expect("in front");
        prop_assert!((found - point).norm() < 1e-9);
    }

    #[test]
    fn rays_from_several_places_give_back_their_point(
        point in [-0.05..0.05f64, -0.05..0.05f64, 0.05..0.2f64],
        sideways in 0.003..0.03f64,
        views in 2..5usize,
    ) {
        let point = Point3::from(point);
        let rays: Vec<Ray> = (0..views)
            .map(|view| {
                let origin = Point3::new(sideways * view as f64, 0.0, 0.001 * view as f64);
                Ray { origin, direction: Unit::new_normalize(point - origin) }
            })
            .collect();
        let found = midpoint(&rays).expect("in front");
        prop_assert!((found - point).norm() < 1e-9);
    }
}
