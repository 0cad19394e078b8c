//! CPU mirror of `fit_patch.wgsl` in double precision.

use nalgebra::{Matrix3, Vector3};

use super::fit_patch::{self, Patch};
use super::testing::{grid, holding, known, planes, shipped_bench};
use crate::disparity::DisparityConfig;
use crate::disparity::testing::{NO_DISPARITY, SIZES};
use crate::testing::Numbers;

/// The plane of a patch with its standard deviation, the plane it had where there is none, and whether rounding may
/// decide otherwise.
fn patch(
    asked: &[[f32; 4]],
    own: [f32; 4],
    (x, y): (i64, i64),
    size: (u32, u32),
    config: &DisparityConfig,
) -> ([f64; 4], bool) {
    let own = own.map(f64::from);
    let (mut normal, mut right, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    let (mut count, mut close) = (0, false);
    let stride = i64::from(config.patch.stride_px);
    for (u, v) in (-2..=2).flat_map(|v| (-2..=2).map(move |u| (u * stride, v * stride))) {
        let (x, y) = (x + u, y + v);
        if x < 0 || y < 0 || x >= size.0.into() || y >= size.1.into() {
            continue;
        }
        let [d, z, w, _] = asked[(y * i64::from(size.0) + x) as usize].map(f64::from);
        let row = Vector3::new(1.0, u as f64, v as f64);
        let off = (d - row.dot(&Vector3::new(own[0], own[1], own[2]))).abs();
        close |= (off - config.patch.gate_px).abs() < 1e-4;
        if off <= config.patch.gate_px {
            normal += w * row * row.transpose();
            right += w * row * (z - own[0]);
            square += w * (z - own[0]) * (z - own[0]);
            count += 1;
        }
    }
    let weight = normal[(0, 0)];
    let spanned = normal.determinant() / f64::max(weight, 1e-12);
    close |= (spanned / (weight * weight).max(1e-12) - 0.001).abs() < 1e-3;
    let Some(plane) = normal.try_inverse().map(|inverse| inverse * right) else { return (own, close) };
    close |= (plane[0].abs() - config.patch.shift_max_px).abs() < 1e-3;
    if count < 6 || spanned <= 0.001 * weight * weight || plane[0].abs() > config.patch.shift_max_px {
        return (own, close);
    }
    let spread = &config.patch;
    let terms = [
        spread.floor_px,
        spread.residual_factor * ((square - plane.dot(&right)).max(0.0) / weight).sqrt(),
        spread.noise_levels / weight.sqrt(),
        spread.missing_px * (1.0 - f64::from(count) / 25.0),
    ];
    let sigma = terms.iter().map(|term| term * term).sum::<f64>().sqrt();
    ([own[0] + plane[0], plane[1], plane[2], sigma], close)
}

#[test]
fn patches_equal_the_mirror_and_keep_their_plane_where_there_is_no_other() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let given = planes(size, 71);
        let mut numbers = Numbers::new(72);
        let asked: Vec<[f32; 4]> = given
            .iter()
            .map(|plane| match known(plane[0]) {
                true => [plane[0], plane[0] + 0.5 * numbers.next() as f32, 3.0 + numbers.next() as f32, 0.0],
                false => [NO_DISPARITY, NO_DISPARITY, 0.0, 0.0],
            })
            .collect();
        let (targets, fitted) = (holding(&bench, &asked), holding(&bench, &given));
        let patch_fit = Patch::new(&bench.config.patch);
        let kernel = fit_patch::bind(&bench.gpu, &bench.uniform, &patch_fit, &targets, &fitted).unwrap();
        bench.run(&kernel, grid(&bench));
        let (mut compared, mut moved) = (0, 0);
        for (index, found) in bench.gpu.read(&fitted).unwrap().into_iter().enumerate() {
            if !known(given[index][0]) || given[index][0].is_infinite() {
                assert_eq!(found.map(f32::to_bits), given[index].map(f32::to_bits));
                continue;
            }
            let at = (index as i64 % i64::from(size.0), index as i64 / i64::from(size.0));
            let (expected, close) = patch(&asked, given[index], at, size, &bench.config);
            if close {
                continue;
            }
            let error = (0..4).map(|k| (f64::from(found[k]) - expected[k]).abs()).fold(0.0, f64::max);
            assert!(error < 3e-3, "{at:?} of {size:?}: {found:?}, expected {expected:?}");
            compared += 1;
            moved += usize::from(found != given[index]);
        }
        assert!(compared * 2 > given.len() && moved * 4 > given.len(), "{compared} compared, {moved} moved");
    }
}
