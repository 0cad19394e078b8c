//! CPU mirrors of `band_cost.wgsl` and `band_winner.wgsl`.

use super::band_winner::Choice;
use super::testing::{bench, holding, known, planes};
use super::{band_cost, band_winner};
use crate::disparity::buffers::Images;
use crate::disparity::census;
use crate::disparity::testing::{Bench, NO_DISPARITY, SIZES, config, unpadded};

const SILENT: u32 = 1 << 31;

/// Disparity of index 0.
fn start(prior: f32) -> i64 {
    (prior + 0.5).floor().clamp(-32768.0, 32768.0) as i64 - 8
}

fn described(size: (u32, u32), paths: u32) -> (Bench, [Vec<u32>; 2]) {
    let mut config = config();
    config.sgm.paths = paths;
    let bench = bench(size, config);
    for (eye, output) in [bench.input.left(), bench.input.right()].into_iter().zip(&bench.images.descriptors)
    {
        bench.run(&census::bind(&bench.gpu, &bench.uniform, eye, output).unwrap(), bench.words());
    }
    let descriptors =
        [0, 1].map(|eye| bench.gpu.read(&bench.images.descriptors[eye]).unwrap().as_flattened().to_vec());
    (bench, descriptors)
}

#[test]
fn costs_about_the_prior_equal_the_mirror() {
    for size in SIZES {
        let (bench, [left, right]) = described(size, 4);
        let given = planes(size, 91);
        let prior = holding(&bench, &given);
        let silent = bench.config.sgm.silent_cost;
        let kernel = band_cost::bind(&bench.gpu, silent, &bench.images, &prior, &bench.volumes).unwrap();
        bench.run(&kernel, [size.0, size.1, 1]);
        let stride = 4 * bench.whole.words as usize;
        for (index, found) in bench.bytes(&bench.volumes.costs).into_iter().enumerate() {
            let (k, pixel) = (index % 16, index / 16);
            let (x, y) = (pixel % size.0 as usize, pixel / size.0 as usize);
            let own = left[y * stride + x];
            let partner = x as i64 - start(given[pixel][0]) - k as i64;
            let candidate =
                (0..i64::from(size.0)).contains(&partner).then(|| right[y * stride + partner as usize]);
            let expected = match candidate {
                Some(other) if (own | other) & SILENT == 0 && known(given[pixel][0]) => {
                    (own ^ other).count_ones()
                }
                _ => silent,
            };
            assert_eq!(u32::from(found), expected, "({x}, {y}), index {k}, {size:?}");
        }
    }
}

fn check_winners(size: (u32, u32), paths: u32) {
    let (bench, [left, _]) = described(size, paths);
    let given = planes(size, 92);
    let prior = holding(&bench, &given);
    let mut sums = vec![0u32; bench.whole.pixels() * 16];
    for (seed, volume) in (93..).zip(&bench.volumes.sums) {
        let bytes = bench.fill(volume, seed, 120.0);
        sums.iter_mut().zip(bytes).for_each(|(sum, byte)| *sum += u32::from(byte));
    }
    let (sgm, spread) = (&bench.config.sgm, &bench.config.spread);
    let choice = Choice::new(sgm, spread);
    let kernel = band_winner::bind(&bench.gpu, &choice, &bench.images, &prior, &bench.volumes).unwrap();
    bench.run(&kernel, bench.words());
    let Images { matched, spreads, .. } = &bench.images;
    let [found, spreads] =
        [matched, spreads].map(|image| unpadded(&bench.whole, &bench.gpu.read(image).unwrap()));
    let stride = 4 * bench.whole.words as usize;
    let mut accepted = 0;
    for (pixel, (found, spread_found)) in found.into_iter().zip(spreads).enumerate() {
        let costs = &sums[16 * pixel..16 * pixel + 16];
        let best = (0..16).min_by_key(|&k| (costs[k], k)).unwrap();
        let silent = left[pixel / size.0 as usize * stride + pixel % size.0 as usize] & SILENT != 0;
        if silent || !known(given[pixel][0]) || best == 0 || best == 15 {
            assert_eq!(found, NO_DISPARITY, "pixel {pixel}");
            continue;
        }
        let [fall, rise] = [best - 1, best + 1].map(|k| f64::from(costs[k]) - f64::from(costs[best]));
        let lifted =
            f64::from(sgm.paths * sgm.small_penalty).min(sgm.subpixel_penalty_share * rise.min(fall));
        let (a, b) = (fall - lifted, rise - lifted);
        let offset = 0.25 * (a - b) / (a + b).max(0.001) + 0.25 * (a - b) / a.max(b).max(0.001);
        let expected = (start(given[pixel][0]) + best as i64) as f64 + offset.clamp(-0.5, 0.5);
        assert!(
            (f64::from(found) - expected).abs() < 1e-3 + 1e-7 * expected.abs(),
            "pixel {pixel}: {found}, expected {expected}"
        );
        let of_match = spread.curvature_px * f64::from(sgm.paths) / (fall + rise).max(1.0);
        assert!(
            (f64::from(spread_found) - of_match).abs() < 1e-4,
            "pixel {pixel}: {spread_found}, {of_match}"
        );
        accepted += 1;
    }
    assert!(accepted > 100, "{accepted} accepted: the test shows nothing");
}

#[test]
fn winners_about_the_prior_equal_the_mirror() {
    check_winners(SIZES[0], 8);
    check_winners(SIZES[1], 4);
}
