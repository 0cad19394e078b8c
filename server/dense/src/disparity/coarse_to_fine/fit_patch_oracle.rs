//! CPU mirror of `fit_patch.wgsl` in double precision.

use nalgebra::{Matrix3, Vector3};

use super::aim_patch::PatchTarget;
use super::fit_patch::{self, Patch};
use super::testing::{asked, blocks, holding, known, planes, shipped_bench, silence, wish};
use crate::disparity::DisparityConfig;
use crate::disparity::testing::SIZES;
use crate::testing::Numbers;

/// The plane of a patch with its standard deviation, none where its pixels form no plane, and whether rounding may
/// decide otherwise.
fn patch(
    wishes: &[PatchTarget],
    own: [f32; 4],
    (x, y): (i64, i64),
    size: (u32, u32),
    config: &DisparityConfig,
) -> (Option<[f64; 4]>, bool) {
    let own = own.map(f64::from);
    let (mut normal, mut right, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    let (mut count, mut close) = (0, false);
    let stride = i64::from(config.patch.stride_px);
    for (u, v) in (-2..=2).flat_map(|v| (-2..=2).map(move |u| (u * stride, v * stride))) {
        let (x, y) = (x + u, y + v);
        if x < 0 || y < 0 || x >= size.0.into() || y >= size.1.into() {
            continue;
        }
        let point = wishes[(y * i64::from(size.0) + x) as usize];
        let (step, w) = wish(point);
        let d = f64::from(point.disparity);
        let z = d + step;
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
    let Some(plane) = normal.try_inverse().map(|inverse| inverse * right) else { return (None, close) };
    close |= (plane[0].abs() - config.patch.shift_max_px).abs() < 1e-3;
    if count < 6 || spanned <= 0.001 * weight * weight || plane[0].abs() > config.patch.shift_max_px {
        return (None, close);
    }
    let spread = &config.patch;
    let terms = [
        spread.floor_px,
        spread.residual_factor * ((square - plane.dot(&right)).max(0.0) / weight).sqrt(),
        spread.noise_levels / weight.sqrt(),
        spread.missing_px * (1.0 - f64::from(count) / 25.0),
    ];
    let sigma = terms.iter().map(|term| term * term).sum::<f64>().sqrt();
    (Some([own[0] + plane[0], plane[1], plane[2], sigma]), close)
}

/// The planes of a block's pixels, in order of rows; none where rounding may decide otherwise or a plane is infinite.
fn block(
    wishes: &[PatchTarget],
    given: &[[f32; 4]],
    corner: (i64, i64),
    size: (u32, u32),
    config: &DisparityConfig,
) -> Option<Vec<(usize, [f64; 4])>> {
    let inside = |&(x, y): &(i64, i64)| x < size.0.into() && y < size.1.into();
    let index = |(x, y): (i64, i64)| (y * i64::from(size.0) + x) as usize;
    let places = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(u, v)| (corner.0 + u, corner.1 + v));
    let places: Vec<_> = places.into_iter().filter(inside).collect();
    let mut found: Vec<_> = places.iter().map(|&at| (index(at), given[index(at)].map(f64::from))).collect();
    let mut open: Vec<usize> = (0..places.len()).filter(|&k| known(given[found[k].0][0])).collect();
    if open.iter().any(|&k| !found[k].1[0].is_finite()) {
        return None;
    }
    for _ in 0..2 {
        let Some(&first) = open.first() else { break };
        let plane = given[found[first].0];
        let (fitted, close) = patch(wishes, plane, places[first], size, config);
        let [value, slope_x, slope_y, _] = plane.map(f64::from);
        let from_first =
            |k: usize| ((places[k].0 - places[first].0) as f64, (places[k].1 - places[first].1) as f64);
        let off = |k: usize| {
            let (u, v) = from_first(k);
            (f64::from(given[found[k].0][0]) - value - slope_x * u - slope_y * v).abs()
        };
        let gate = config.patch.gate_px;
        if close || open.iter().any(|&k| (off(k) - gate).abs() < 1e-4) {
            return None;
        }
        let (joined, rest): (Vec<_>, Vec<_>) = open.into_iter().partition(|&k| k == first || off(k) <= gate);
        for (k, fitted) in joined.into_iter().filter_map(|k| Some((k, fitted?))) {
            let (u, v) = from_first(k);
            found[k].1 = [fitted[0] + fitted[1] * u + fitted[2] * v, fitted[1], fitted[2], fitted[3]];
        }
        open = rest;
    }
    Some(found)
}

#[test]
fn patches_equal_the_mirror_and_keep_their_plane_where_there_is_no_other() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let given = planes(size, 71);
        let mut numbers = Numbers::new(72);
        let wishes: Vec<PatchTarget> = given
            .iter()
            .map(|plane| match known(plane[0]) {
                true => asked(plane[0], 0.5 * numbers.next() as f32, 3.0 + numbers.next() as f32),
                false => silence(),
            })
            .collect();
        let (targets, fitted) = (holding(&bench, &wishes), holding(&bench, &given));
        let patch_fit = Patch::new(&bench.config.patch);
        let kernel = fit_patch::bind(&bench.gpu, &bench.uniform, &patch_fit, &targets, &fitted).unwrap();
        bench.run(&kernel, blocks(&bench));
        let all = bench.gpu.read(&fitted).unwrap();
        let (mut compared, mut moved) = (0, 0);
        let [columns, rows, _] = blocks(&bench);
        for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
            let corner = (2 * i64::from(x), 2 * i64::from(y));
            for (index, expected) in block(&wishes, &given, corner, size, &bench.config).into_iter().flatten()
            {
                let found = all[index];
                if !known(given[index][0]) {
                    assert_eq!(found.map(f32::to_bits), given[index].map(f32::to_bits));
                    continue;
                }
                let error = (0..4).map(|k| (f64::from(found[k]) - expected[k]).abs()).fold(0.0, f64::max);
                assert!(error < 3e-3, "{corner:?} of {size:?}: {found:?}, expected {expected:?}");
                compared += 1;
                moved += usize::from(found != given[index]);
            }
        }
        assert!(compared * 2 > given.len() && moved * 4 > given.len(), "{compared} compared, {moved} moved");
    }
}
