//! Lens models against OpenCV's figures and by their own properties.

mod common;

use common::euroc;
use geometry::{CameraModel, Distortion, GeometryError};
use nalgebra::{Point2, Point3};
use proptest::prelude::*;

const RADIAL_TANGENTIAL: Distortion = Distortion::RadialTangential([-0.28, 0.07, 0.0002, 1.7e-5, 0.01]);
const RATIONAL: Distortion = Distortion::Rational([0.5, -0.1, 0.001, -0.0007, 0.02, 0.8, -0.05, 0.015]);

#[test]
fn distorted_points_are_those_of_opencv() {
    // cv2.projectPoints with the identity as camera matrix, OpenCV 5.0.0.
    let ideal = [(0.3, -0.2), (-0.55, 0.4), (0.05, 0.6)];
    let radial_tangential =
        [(0.289422761, -0.192921034), (-0.487624367148, 0.354734121563), (0.045426986758, 0.545122391094)];
    let rational = [
        (0.288830571631, -0.192484381087),
        (-0.490984764379, 0.357306874094),
        (0.045321861566, 0.547269838792),
    ];
    for (lens, expected) in [(RADIAL_TANGENTIAL, radial_tangential), (RATIONAL, rational)] {
        for ((x, y), (shown_x, shown_y)) in ideal.into_iter().zip(expected) {
            let shown = lens.distort(&Point2::new(x, y));
            assert!((shown - Point2::new(shown_x, shown_y)).norm() < 1e-11, "{lens:?} ({x}, {y}): {shown}");
        }
    }
}

#[test]
fn the_undistorted_corner_is_that_of_opencv() {
    // cv2.undistortPoints of pixel (0, 0) with 500 iterations and epsilon 1e-15.
    let ray = euroc().left.ray(&Point2::new(0.0, 0.0)).expect("inside the lens model");
    assert!((ray.xy() - Point2::new(-1.096745824234, -0.744451392019)).norm() < 1e-10, "{ray}");
}

#[test]
fn what_lies_beyond_the_fold_of_the_lens_has_no_ray() {
    // x (1 - 0.5 x^2) has its maximum 0.544 at x = 0.816.
    let lens = Distortion::RadialTangential([-0.5, 0.0, 0.0, 0.0, 0.0]);
    assert!(lens.undistort(&Point2::new(0.54, 0.0)).is_ok());
    assert_eq!(
        lens.undistort(&Point2::new(0.55, 0.0)),
        Err(GeometryError::NotUndistortable { x: 0.55, y: 0.0 })
    );
}

#[test]
fn a_place_that_is_not_a_number_has_no_ray() {
    for lens in [Distortion::None, RADIAL_TANGENTIAL, RATIONAL] {
        assert!(lens.undistort(&Point2::new(f64::NAN, 0.0)).is_err(), "{lens:?}");
    }
}

proptest! {
    #[test]
    fn undistorting_inverts_distorting(x in -0.7..0.7f64, y in -0.6..0.6f64, which in 0..3usize) {
        let lens = [Distortion::None, RADIAL_TANGENTIAL, RATIONAL][which];
        let ideal = Point2::new(x, y);
        let back = lens.undistort(&lens.distort(&ideal)).expect("inside the lens model");
        prop_assert!((back - ideal).norm() < 1e-10);
    }

    #[test]
    fn a_projected_point_lies_on_the_ray_of_its_pixel(
        x in -0.6..0.6f64, y in -0.5..0.5f64, z in 0.02..10.0f64,
    ) {
        let camera = CameraModel { distortion: RATIONAL, ..euroc().left };
        let point = Point3::new(x * z, y * z, z);
        let ray = camera.ray(&camera.project(&point)).expect("inside the lens model");
        prop_assert!((ray * z - point).norm() < 1e-9 * z);
    }
}
