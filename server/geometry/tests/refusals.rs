//! Calibrations that are refused, and what the refusal says.

mod common;

use common::euroc;
use geometry::validate::{check_calibration, check_rig};
use geometry::{GeometryError, Pinhole, RigLimits, StereoCalibration, StereoRig};

#[derive(serde::Deserialize)]
struct Config {
    rig: RigLimits,
}

fn limits() -> RigLimits {
    let text = include_str!("../../../config/server.toml");
    toml::from_str::<Config>(text).expect("the shipped configuration").rig
}

fn scope() -> StereoRig {
    let left =
        Pinhole { width_px: 640, height_px: 480, fx_px: 520.0, fy_px: 520.0, cx_px: 320.0, cy_px: 240.0 };
    StereoRig { left, baseline_m: 0.005, right_cx_px: 331.0 }
}

fn refusal(change: impl FnOnce(&mut StereoRig)) -> String {
    let mut rig = scope();
    change(&mut rig);
    check_rig(&rig, &limits()).expect_err("refused").to_string()
}

#[test]
fn a_stereo_endoscope_is_accepted() {
    assert_eq!(check_rig(&scope(), &limits()), Ok(()));
}

#[test]
fn each_refusal_names_its_field_and_value() {
    let refusals = [
        (refusal(|rig| rig.left.fx_px = 0.0), "left.fx_px = 0,"),
        (refusal(|rig| rig.left.fx_px = f64::NAN), "left.fx_px = NaN,"),
        (refusal(|rig| rig.left.fy_px = -520.0), "left.fy_px = -520,"),
        (refusal(|rig| rig.left.fy_px = f64::INFINITY), "left.fy_px = inf,"),
        (refusal(|rig| rig.left.cx_px = 640.0), "left.cx_px = 640,"),
        (refusal(|rig| rig.left.cy_px = -0.5), "left.cy_px = -0.5,"),
        (refusal(|rig| rig.left.cy_px = f64::NAN), "left.cy_px = NaN,"),
        (refusal(|rig| rig.right_cx_px = 900.0), "right_cx_px = 900,"),
        (refusal(|rig| rig.left.width_px = 0), "left.width_px = 0,"),
        (refusal(|rig| rig.left.height_px = 8193), "left.height_px = 8193,"),
        (refusal(|rig| rig.baseline_m = f64::NAN), "baseline_m = NaN,"),
    ];
    for (message, expected) in refusals {
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
    }
}

#[test]
fn a_baseline_outside_the_limits_is_refused_with_the_limits() {
    for (baseline_m, expected) in [(0.0, "0 mm"), (0.0005, "0.5 mm"), (0.11, "110 mm")] {
        let message = refusal(|rig| rig.baseline_m = baseline_m);
        assert!(message.contains(expected) && message.contains("1 to 20 mm"), "{message}");
    }
}

#[test]
fn wider_limits_accept_a_car() {
    let mut rig = scope();
    rig.baseline_m = 0.537;
    let limits = RigLimits { baseline_max_mm: 600.0, ..limits() };
    assert_eq!(check_rig(&rig, &limits), Ok(()));
}

#[test]
fn swapped_eyes_are_called_so() {
    let message = refusal(|rig| rig.baseline_m = -0.005);
    assert!(message.contains("left and right are swapped"), "{message}");
}

fn raw_refusal(change: impl FnOnce(&mut StereoCalibration)) -> GeometryError {
    let mut calibration = euroc();
    change(&mut calibration);
    let limits = RigLimits { baseline_max_mm: 200.0, ..limits() };
    check_calibration(&calibration, &limits).expect_err("refused")
}

#[test]
fn a_raw_calibration_is_accepted_within_its_limits_only() {
    let wide = RigLimits { baseline_max_mm: 200.0, ..limits() };
    assert_eq!(check_calibration(&euroc(), &wide), Ok(()));
    assert!(matches!(check_calibration(&euroc(), &limits()), Err(GeometryError::Baseline { .. })));
}

#[test]
fn raw_cameras_are_checked_field_by_field() {
    let named = |error: GeometryError, expected: &str| {
        let message = error.to_string();
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
    };
    named(raw_refusal(|raw| raw.right.pinhole.fx_px = 0.0), "right.fx_px = 0,");
    named(raw_refusal(|raw| raw.right.pinhole.width_px = 640), "right.width_px = 640, it must be the left");
    named(
        raw_refusal(|raw| {
            let lens = [0.0, f64::NAN, 0.0, 0.0, 0.0];
            raw.left.distortion = geometry::Distortion::RadialTangential(lens);
        }),
        "left.distortion[1] = NaN,",
    );
    named(
        raw_refusal(|raw| raw.right_from_left.translation.vector.z = f64::NAN),
        "right_from_left.translation = NaN,",
    );
    named(
        raw_refusal(|raw| {
            let broken = nalgebra::Quaternion::new(f64::NAN, 0.0, 0.0, 0.0);
            raw.right_from_left.rotation = nalgebra::Unit::new_unchecked(broken);
        }),
        "right_from_left.rotation = NaN,",
    );
}

#[test]
fn raw_cameras_that_are_swapped_or_stacked_are_refused() {
    let swapped = raw_refusal(|raw| raw.right_from_left = raw.right_from_left.inverse());
    assert!(matches!(swapped, GeometryError::SwappedEyes { baseline_m } if baseline_m < 0.0), "{swapped}");
    let stacked = raw_refusal(|raw| raw.right_from_left.translation.vector = [0.0, -0.1, 0.0].into());
    assert!(matches!(stacked, GeometryError::NotSideBySide { .. }), "{stacked}");
}
