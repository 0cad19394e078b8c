//! CPU mirror of `compare_depth.wgsl` and `judge_frame.wgsl`.

use nalgebra::{Point3, Vector3};

use super::{BackProjection, compare_depth, judge_frame};
use crate::fusion::{ERROR_BINS, HELD_OUT_HISTOGRAM, HISTOGRAM, RESULTS};
use crate::testing::{Fixture, SLOTS};

/// Bin of the error of each pixel that has both depths; slot per pixel as the fixture's index map is filled below.
fn error_bins(fixture: &Fixture, slots: &[u32]) -> Vec<usize> {
    let camera_from_world = fixture.view.world_from_camera.inverse();
    let error = |pixel: usize| {
        let observed = f64::from(fixture.depth[pixel]);
        if slots[pixel] == 0 || !observed.is_finite() || observed <= 0.0 {
            return None;
        }
        let slot = !slots[pixel] as usize;
        let [x, y, z, radius] = fixture.rows.geometry[slot].map(f64::from);
        let [nx, ny, nz, _] = fixture.rows.orientation[slot].map(f64::from);
        let center = camera_from_world * Point3::new(x, y, z);
        let normal = camera_from_world.rotation * Vector3::new(nx, ny, nz);
        let camera = &fixture.view.pinhole;
        let (column, row) = (pixel % camera.width_px as usize, pixel / camera.width_px as usize);
        let ray = Vector3::new(
            (column as f64 - camera.cx_px) / camera.fx_px,
            (row as f64 - camera.cy_px) / camera.fy_px,
            1.0,
        );
        let met = normal.dot(&center.coords) / normal.dot(&ray);
        let error = (met.max(center.z - radius).min(center.z + radius) - observed).abs();
        let held_out = (column / 16 + 3 * (row / 16)).is_multiple_of(7);
        let histogram = if held_out { HELD_OUT_HISTOGRAM } else { HISTOGRAM };
        let bin = ((error / f64::from(fixture.settings.error_bin_m)) as usize).min(ERROR_BINS - 1);
        error.is_finite().then_some(histogram + bin)
    };
    (0..fixture.pixels()).filter_map(error).collect()
}

fn compared(seed: u64) -> (Fixture, Vec<u32>, Vec<u32>) {
    let fixture = Fixture::new(seed);
    let usable = |slot: usize| slot % 17 != 16;
    let slots: Vec<u32> = (0..fixture.pixels())
        .map(|pixel| if pixel % 3 == 0 || !usable(pixel % SLOTS) { 0 } else { !((pixel % SLOTS) as u32) })
        .collect();
    fixture.gpu.write(&fixture.buffers.index_map.slots, 0, &slots).unwrap();
    let kernel = compare_depth::bind(&fixture.gpu, &fixture.buffers).unwrap();
    let invocations = fixture.pixels().div_ceil(super::PIXELS_PER_INVOCATION as usize);
    fixture.run(&kernel, invocations, |frame| frame.clear(&fixture.buffers.results));
    let results = fixture.gpu.read(&fixture.buffers.results).unwrap();
    (fixture, slots, results)
}

#[test]
fn the_error_histogram_agrees_with_its_oracle() {
    let (fixture, slots, results) = compared(5);
    let measured = fixture.depth.iter().filter(|depth| depth.is_finite() && **depth > 0.0).count();
    assert_eq!(results[0] as usize, measured);
    let bins = error_bins(&fixture, &slots);
    let mut expected = vec![0i64; RESULTS];
    for &bin in &bins {
        expected[bin] += 1;
    }
    let held_out = bins.iter().filter(|&&bin| bin >= HELD_OUT_HISTOGRAM).count();
    assert!(bins.len() > 300 && held_out > 30, "{} and {held_out}", bins.len());
    // an error at the border of two bins may fall into either
    let moved: i64 = (HISTOGRAM..RESULTS).map(|bin| (i64::from(results[bin]) - expected[bin]).abs()).sum();
    assert!(moved <= 6, "{moved}");
    assert_eq!(compared(5).2, results, "two runs");
}

#[test]
fn quantiles_and_moments_come_from_the_histogram() {
    let mut results = vec![0u32; RESULTS];
    results[0] = 200;
    for bin in 0..100 {
        results[HISTOGRAM + bin] = 1;
    }
    let error = BackProjection::from_results(&results, 1e-3).unwrap();
    let close = |value: f64, expected: f64| assert!((value - expected).abs() < 1e-9, "{value} {expected}");
    close(error.mean_m, 0.05);
    close(error.median_m, 0.0495);
    close(error.p95_m, 0.0945);
    close(error.coverage, 0.5);
    assert_eq!(error.held_out, None);
    results[HELD_OUT_HISTOGRAM + 199] = 100;
    let error = BackProjection::from_results(&results, 1e-3).unwrap();
    let held_out = error.held_out.unwrap();
    close(held_out.mean_m, 0.1995);
    close(held_out.rmse_m, 0.1995);
    close(held_out.others_mean_m, 0.05);
    close(error.mean_m, (0.05 + 0.1995) / 2.0);
    assert_eq!(BackProjection::from_results(&vec![0; RESULTS], 1e-3), None);
}

#[test]
fn a_frame_is_judged_by_its_mean_error_where_enough_of_the_model_is_in_view() {
    let fixture = Fixture::new(6);
    let kernel = judge_frame::bind(&fixture.gpu, &fixture.buffers).unwrap();
    let bin_of_limit = (fixture.settings.error_max_m / fixture.settings.error_bin_m) as usize;
    let accepted = |compared: u32, bin: usize, accept_always: u32| {
        fixture.write_results(&[1000]);
        fixture.gpu.write(&fixture.buffers.results, HISTOGRAM + bin, &[compared]).unwrap();
        let mut settings = fixture.settings;
        settings.accept_always = accept_always;
        fixture.gpu.write(&fixture.buffers.settings, 0, &[settings]).unwrap();
        fixture.run(&kernel, 1, |_| ());
        fixture.gpu.read(&fixture.buffers.results).unwrap()[1] == 1
    };
    assert!(accepted(900, bin_of_limit - 2, 0));
    assert!(!accepted(900, bin_of_limit + 2, 0));
    assert!(accepted(900, bin_of_limit + 2, 1));
    assert!(accepted(20, bin_of_limit + 2, 0));
    assert!(accepted(0, 0, 0));
}
