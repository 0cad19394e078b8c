//! The whole matching on pairs of which the disparity is known.

use geometry::{Mask, Raster, Rgb};
use gpu::KernelDeclaration;

use super::testing::{config, hostile, pair};
use super::{DisparityConfig, DisparityMap, DisparityRange, Pair, compute, eye_order, kernels};
use crate::DenseError;
use crate::testing::gpu;

const SIZE: (u32, u32) = (161, 120);

fn range() -> DisparityRange {
    DisparityRange::new(0, 30).unwrap()
}

fn matched(left: &Rgb, right: &Rgb, config: &DisparityConfig) -> DisparityMap {
    compute(&gpu(), &Pair { left, right, mask: None }, range(), config).unwrap()
}

/// Mean and largest error inside the image where both eyes see the surface, and the share known there.
fn errors(map: &DisparityMap, of: impl Fn(f64, f64) -> f64) -> (f64, f64, f64) {
    let inside: Vec<(u32, u32)> =
        (6..SIZE.1 - 6).flat_map(|y| (40..SIZE.0 - 6).map(move |x| (x, y))).collect();
    let known: Vec<f64> = inside
        .iter()
        .map(|&(x, y)| f64::from(map.disparity[(x, y)]) - of(x.into(), y.into()))
        .filter(|error| error.is_finite())
        .map(f64::abs)
        .collect();
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    (
        mean,
        known.iter().fold(0.0, |largest, &error| largest.max(error)),
        known.len() as f64 / inside.len() as f64,
    )
}

#[test]
fn a_shifted_texture_gives_its_shift_to_an_eighth_of_a_pixel() {
    for shift in [4.0, 9.25, 13.5, 17.8] {
        let (left, right) = pair(SIZE, 31, |_, _| shift);
        let (mean, largest, share) = errors(&matched(&left, &right, &config()), |_, _| shift);
        assert!(mean < 0.125 && largest < 0.35 && share > 0.97, "{shift}: {mean} {largest} {share}");
    }
}

#[test]
fn a_slanted_plane_is_measured_without_steps() {
    let slanted = |x: f64, y: f64| 6.0 + 0.07 * x + 0.04 * y;
    let (left, right) = pair(SIZE, 32, slanted);
    let (mean, largest, share) = errors(&matched(&left, &right, &config()), slanted);
    assert!(mean < 0.08 && largest < 0.5 && share > 0.95, "{mean} {largest} {share}");
}

#[test]
fn eight_paths_serve_as_well() {
    let mut config = config();
    config.sgm.paths = 8;
    let (left, right) = pair(SIZE, 33, |_, _| 8.4);
    let (mean, _, share) = errors(&matched(&left, &right, &config), |_, _| 8.4);
    assert!(mean < 0.125 && share > 0.97, "{mean} {share}");
}

#[test]
fn negative_disparities_are_found_where_the_range_holds_them() {
    let (left, right) = pair(SIZE, 34, |_, _| -7.3);
    let range = DisparityRange::new(-20, 5).unwrap();
    let map = compute(&gpu(), &Pair { left: &left, right: &right, mask: None }, range, &config()).unwrap();
    let middle = map.disparity[(80, 60)];
    assert!((middle + 7.3).abs() < 0.2, "{middle}");
}

#[test]
fn black_saturated_and_even_pictures_give_nothing() {
    for level in [0, 128, 255] {
        let even = Rgb::filled(SIZE.0, SIZE.1, [level; 3]);
        let coverage = matched(&even, &even, &config()).coverage();
        assert!(coverage == 0.0, "grey level {level}: {coverage}");
    }
}

#[test]
fn noise_matches_hardly_anywhere_and_never_gives_nan() {
    let map = matched(&hostile(SIZE, 35), &hostile(SIZE, 36), &config());
    assert!(map.coverage() < 0.1, "{}", map.coverage());
    let values = map.disparity.pixels().iter().chain(map.variance.pixels());
    assert!(values.clone().all(|value| !value.is_nan()));
    assert!(map.variance.pixels().iter().all(|&variance| variance > 0.0));
}

#[test]
fn two_runs_give_the_same_bits() {
    let (left, right) = pair(SIZE, 37, |x, y| 5.0 + 0.05 * x + (y * 0.1).sin());
    let [a, b] = [0, 1].map(|_| matched(&left, &right, &config()));
    let bits = |image: &Raster<f32>| image.pixels().iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&a.disparity), bits(&b.disparity));
    assert_eq!(bits(&a.variance), bits(&b.variance));
}

#[test]
fn bands_agree_with_the_whole_image() {
    // 32 disparities of a row of 81 px in three volumes take 7,776 bytes: 1 MiB holds 134 of the 200 halved rows
    let tall = (161, 400);
    let (left, right) = pair(tall, 38, |x, y| 6.0 + 0.03 * x + 0.02 * y);
    let whole = matched(&left, &right, &config());
    let banded = DisparityConfig { volume_mib: 1, band_margin_px: 32, ..config() };
    let input = crate::preprocess::Preprocess::new(&gpu(), tall, &banded).unwrap();
    let stage = super::DisparityStage::new(&gpu(), &input, range(), &banded).unwrap();
    assert!(stage.band_count() > 1, "{} band", stage.band_count());
    let banded = matched(&left, &right, &banded);
    let differences = whole.disparity.pixels().iter().zip(banded.disparity.pixels());
    let differing =
        differences.filter(|(a, b)| (*a - *b).abs() > 0.05 || a.is_finite() != b.is_finite()).count();
    assert!(differing * 500 < (tall.0 * tall.1) as usize, "{differing} pixels differ");
}

#[test]
fn covered_pixels_give_no_disparity() {
    let (left, right) = pair(SIZE, 39, |_, _| 8.0);
    let mask: Mask = Raster::from_fn(SIZE.0, SIZE.1, |x, y| u8::from(x > 90 && y > 50) * 255);
    let map =
        compute(&gpu(), &Pair { left: &left, right: &right, mask: Some(&mask) }, range(), &config()).unwrap();
    assert!(map.disparity[(120, 80)].is_infinite());
    assert!((map.disparity[(80, 40)] - 8.0).abs() < 0.2);
}

#[test]
fn exchanged_eyes_are_noticed_and_right_ones_are_not() {
    let (left, right) = pair((320, 120), 40, |x, _| 10.0 + 0.03 * x);
    let order = eye_order(&gpu(), (&left, &right), range(), &config()).unwrap();
    assert!(!order.is_swapped(), "{order:?}");
    let exchanged = eye_order(&gpu(), (&right, &left), range(), &config()).unwrap();
    assert!(exchanged.is_swapped(), "{exchanged:?}");
    let black = Rgb::filled(320, 120, [0; 3]);
    assert!(!eye_order(&gpu(), (&black, &black), range(), &config()).unwrap().is_swapped());
}

#[test]
fn eyes_of_different_size_are_refused() {
    let (left, right) = (Rgb::filled(64, 48, [9; 3]), Rgb::filled(64, 47, [9; 3]));
    let refused = compute(&gpu(), &Pair { left: &left, right: &right, mask: None }, range(), &config());
    assert_eq!(
        refused.unwrap_err(),
        DenseError::ImageSize { what: "right", found: (64, 47), expected: (64, 48) }
    );
}

#[test]
fn every_kernel_is_valid_also_when_unrolled() {
    let all = kernels().into_iter().chain(crate::preprocess::kernels());
    let unrolled = [super::aggregate::declaration(8), super::winner::declaration(8)];
    for declaration in all.chain(unrolled) {
        KernelDeclaration::reflect(&declaration).unwrap();
    }
}

#[test]
fn unusable_options_are_named() {
    let refused = |change: fn(&mut DisparityConfig)| {
        let mut changed = config();
        change(&mut changed);
        changed.check().unwrap_err().to_string()
    };
    config().check().unwrap();
    assert!(refused(|config| config.sgm.paths = 5).contains("disparity.sgm.paths = 5"));
    assert!(refused(|config| config.sgm.jump_penalty_max = 97).contains("jump_penalty_max"));
    assert!(refused(|config| config.far_mm = f64::NAN).contains("disparity.far_mm"));
    assert!(refused(|config| config.filter.first_gate_px = -1.0).contains("first_gate_px"));
    assert!(refused(|config| config.sgm.coarse_level = 9).contains("disparity.sgm.coarse_level = 9"));
    assert!(
        refused(|config| config.narrow.jump_penalty_min = 1).contains("disparity.narrow.jump_penalty_min")
    );
    assert!(refused(|config| config.patch.gate_px = f64::NAN).contains("disparity.patch.gate_px"));
}

#[test]
fn the_range_follows_the_rig_and_the_working_distance() {
    let left = geometry::Pinhole {
        width_px: 640,
        height_px: 480,
        fx_px: 520.0,
        fy_px: 520.0,
        cx_px: 320.0,
        cy_px: 240.0,
    };
    let rig = geometry::StereoRig { left, baseline_m: 0.005, right_cx_px: 330.0 };
    let config = DisparityConfig { near_mm: 26.0, far_mm: 260.0, ..config() };
    // 100 px at 26 mm and 10 px at 260 mm, less the 10 px between the principal points
    let range = DisparityRange::of_rig(&rig, &config).unwrap();
    assert_eq!((range.min_px, range.count()), (0, 96));
    let set = DisparityConfig { max_disparity_px: super::RangeEnd::Px(500), ..config };
    assert!(DisparityRange::of_rig(&rig, &set).unwrap_err().to_string().contains("max_disparity_px"));
}
