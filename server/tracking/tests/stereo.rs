//! Row matching on rendered pairs of known disparity.

mod support;

use geometry::{Gray, Pose, Raster};
use support::{Relief, config, rig};
use tracking::feature::Extractor;
use tracking::{FrameFeatures, StereoFrame, TrackingConfig};

fn features(left: &Gray, right: &Gray, config: &TrackingConfig) -> FrameFeatures {
    let frame = StereoFrame { stamp_ns: 0, left, right, mask: None };
    FrameFeatures::extract(&frame, &rig(), &Extractor::new(&config.features), config)
}

/// Depth errors of a fronto-parallel view of the relief against its known surface, px of disparity, sorted.
fn disparity_errors_px(found: &FrameFeatures, shift_px: f64) -> Vec<f64> {
    let mut errors: Vec<f64> = (0..found.len())
        .filter_map(|index| {
            Some(found.pixel(index).x - f64::from(found.stereo[index]?.right_x_px) - shift_px)
        })
        .map(f64::abs)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// A texture and the same moved to the left by a fraction of a pixel and some rows.
fn shifted_pair(shift_px: f64, rows: u32) -> (Gray, Gray) {
    let (wide, _) = Relief::render(&rig(), &Pose::identity());
    let sample = |x: f64, y: u32| {
        let first = x.floor().clamp(0.0, 318.0) as u32;
        let part = (x - f64::from(first)).clamp(0.0, 1.0);
        let row = y.min(239);
        f64::from(wide[(first, row)]) * (1.0 - part) + f64::from(wide[(first + 1, row)]) * part
    };
    let right = Raster::from_fn(320, 240, |x, y| sample(f64::from(x) + shift_px, y + rows).round() as u8);
    (wide, right)
}

#[test]
fn a_known_shift_is_measured_to_a_tenth_of_a_pixel() {
    for shift_px in [11.0, 14.25, 17.5] {
        let (left, right) = shifted_pair(shift_px, 0);
        let errors = disparity_errors_px(&features(&left, &right, &config()), shift_px);
        assert!(errors.len() > 300, "{} matches", errors.len());
        assert!(errors[errors.len() / 2] < 0.1, "median error {} px", errors[errors.len() / 2]);
        assert!(errors[errors.len() * 9 / 10] < 0.4, "p90 {} px", errors[errors.len() * 9 / 10]);
    }
}

#[test]
fn two_rows_of_misalignment_are_tolerated() {
    let (left, right) = shifted_pair(14.0, 2);
    let errors = disparity_errors_px(&features(&left, &right, &config()), 14.0);
    assert!(errors.len() > 250, "{} matches", errors.len());
    assert!(errors[errors.len() / 2] < 0.15, "median error {} px", errors[errors.len() / 2]);
}

#[test]
fn swapped_eyes_lose_most_matches() {
    let (left, right) = shifted_pair(14.0, 0);
    let (right_way, wrong_way) = (features(&left, &right, &config()), features(&right, &left, &config()));
    let counts = (right_way.stereo_count(), wrong_way.stereo_count());
    assert!(counts.1 * 2 < counts.0, "{counts:?}");
}

#[test]
fn depths_lie_on_the_rendered_surface() {
    let (left, right) = Relief::render(&rig(), &Pose::identity());
    let found = features(&left, &right, &config());
    let depths: Vec<f64> = found.stereo.iter().flatten().map(|stereo| stereo.depth_m).collect();
    let plausible = depths.iter().filter(|depth| (0.072..0.088).contains(*depth)).count();
    assert!(depths.len() > 300 && plausible * 100 > depths.len() * 95, "{plausible} of {}", depths.len());
}
