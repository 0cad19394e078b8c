//! ELAS as a whole on pairs of which the disparity is known.

use geometry::Rgb;

use crate::disparity::testing::{config, hostile, pair};
use crate::disparity::{DisparityConfig, DisparityMap, DisparityRange, Method, Pair, compute};
use crate::testing::gpu;

const SIZE: (u32, u32) = (161, 120);

fn elas() -> DisparityConfig {
    DisparityConfig { method: Method::Elas, ..config() }
}

fn matched(left: &Rgb, right: &Rgb, config: &DisparityConfig) -> DisparityMap {
    let range = DisparityRange::new(0, 30).unwrap();
    compute(&gpu(), &Pair { left, right, mask: None }, range, config).unwrap()
}

/// Mean error inside the image where both eyes see the surface, and the share known there.
fn errors(map: &DisparityMap, of: impl Fn(f64, f64) -> f64) -> (f64, f64) {
    let inside: Vec<(u32, u32)> =
        (8..SIZE.1 - 8).flat_map(|y| (40..SIZE.0 - 8).map(move |x| (x, y))).collect();
    let error = |&(x, y): &(u32, u32)| (f64::from(map.disparity[(x, y)]) - of(x.into(), y.into())).abs();
    let known: Vec<f64> = inside.iter().map(error).filter(|error| error.is_finite()).collect();
    (known.iter().sum::<f64>() / known.len() as f64, known.len() as f64 / inside.len() as f64)
}

#[test]
fn shifts_and_slants_are_measured_to_a_fraction_of_a_pixel() {
    let shifted = [4.0, 9.25, 13.5, 17.8].map(|shift| (shift, 0.0));
    for (start, slope) in shifted.into_iter().chain([(6.0, 0.07)]) {
        let of = |x: f64, y: f64| start + slope * (x + 0.5 * y);
        let (left, right) = pair(SIZE, 91, of);
        let (mean, share) = errors(&matched(&left, &right, &elas()), of);
        assert!(mean < 0.15 && share > 0.95, "{start} + {slope} x: {mean} {share}");
    }
}

#[test]
fn every_option_of_the_filters_and_the_prior_keeps_the_measurement() {
    let (left, right) = pair(SIZE, 92, |x, _| 8.4 + 0.02 * x);
    let changes: [fn(&mut DisparityConfig); 5] = [
        |config| config.elas.filter_median = true,
        |config| config.elas.filter_adaptive_mean = false,
        |config| config.elas.add_corners = !config.elas.add_corners,
        |config| config.elas.ipol_gap_width = 40,
        |config| config.elas.sradius = 6.0,
    ];
    for change in changes {
        let mut config = elas();
        change(&mut config);
        let (mean, share) = errors(&matched(&left, &right, &config), |x, _| 8.4 + 0.02 * x);
        assert!(mean < 0.15 && share > 0.9, "{:?}: {mean} {share}", config.elas);
    }
}

#[test]
fn black_saturated_even_and_random_pictures_give_next_to_nothing_and_no_nan() {
    for level in [0, 128, 255] {
        let even = Rgb::filled(SIZE.0, SIZE.1, [level; 3]);
        assert_eq!(matched(&even, &even, &elas()).coverage(), 0.0, "grey level {level}");
    }
    let map = matched(&hostile(SIZE, 93), &hostile(SIZE, 94), &elas());
    assert!(map.coverage() < 0.1, "{}", map.coverage());
    assert!(map.disparity.pixels().iter().chain(map.variance.pixels()).all(|value| !value.is_nan()));
    assert!(map.variance.pixels().iter().all(|&variance| variance > 0.0));
}

#[test]
fn two_runs_give_the_same_bits() {
    let (left, right) = pair(SIZE, 95, |x, y| 5.0 + 0.05 * x + (y * 0.1).sin());
    let bits = || {
        let map = matched(&left, &right, &elas());
        let values = map.disparity.pixels().iter().chain(map.variance.pixels());
        values.map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(), bits());
}

#[test]
fn unusable_options_are_named() {
    let refused = |change: fn(&mut DisparityConfig)| {
        let mut changed = elas();
        change(&mut changed);
        changed.check().unwrap_err().to_string()
    };
    assert!(
        refused(|config| config.elas.candidate_stepsize = 0)
            .contains("disparity.elas.candidate_stepsize = 0")
    );
    assert!(refused(|config| config.elas.beta = f64::NAN).contains("disparity.elas.beta = NaN"));
    assert!(refused(|config| config.elas.sradius = 20.0).contains("disparity.elas.sradius = 20"));
    assert!(refused(|config| config.elas.grid_size = 1).contains("disparity.elas.grid_size = 1"));
}
