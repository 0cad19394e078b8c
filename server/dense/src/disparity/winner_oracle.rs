//! CPU mirrors of `winner.wgsl` and `cross_check.wgsl`.

use super::cross_check::{self, Acceptance};
use super::testing::{Bench, NO_DISPARITY, SIZES, config, pair, unpadded};
use super::{DisparityConfig, DisparityRange, census, winner};

/// The summed costs of a band of random volumes.
struct Sums {
    width: usize,
    disparities: usize,
    min_px: i64,
    sums: Vec<u32>,
}

impl Sums {
    fn of(&self, pixel: usize) -> &[u32] {
        &self.sums[pixel * self.disparities..][..self.disparities]
    }

    /// Least cost and its disparity, and the least cost of words of four disparities not beside that word.
    fn left(&self, pixel: usize) -> (u32, usize, u32) {
        let sums = self.of(pixel);
        let best = (0..sums.len()).min_by_key(|&d| (sums[d], d)).unwrap();
        let elsewhere = (0..sums.len()).filter(|d| (d / 4).abs_diff(best / 4) > 1).map(|d| sums[d]);
        (sums[best], best, elsewhere.min().unwrap_or(0xffff))
    }

    fn right(&self, row: usize, x: i64) -> usize {
        let candidates = (0..self.disparities).filter_map(|d| {
            let left = x + self.min_px + d as i64;
            let inside = (0..self.width as i64).contains(&left);
            inside.then(|| (self.of(row * self.width + left as usize)[d], d))
        });
        candidates.min().unwrap().1
    }

    fn accept(&self, pixel: usize, config: &DisparityConfig) -> (f64, f64) {
        let refused = (f64::from(NO_DISPARITY), 0.0);
        let (best, d, second) = self.left(pixel);
        let partner = (pixel % self.width) as i64 - self.min_px - d as i64;
        if d == 0 || d + 1 == self.disparities || !(0..self.width as i64).contains(&partner) {
            return refused;
        }
        let sgm = &config.sgm;
        let back = self.right(pixel / self.width, partner) as i64 - d as i64;
        if second * (100 - sgm.uniqueness_percent) < best * 100 || back.abs() > sgm.cross_check_px.into() {
            return refused;
        }
        let [below, here, above] = [d - 1, d, d + 1].map(|d| f64::from(self.of(pixel)[d]));
        let (rise, fall) = (above - here, below - here);
        let penalties = f64::from(sgm.paths * sgm.small_penalty);
        let lifted = penalties.min(sgm.subpixel_penalty_share * rise.min(fall));
        let (rise, fall) = (rise - lifted, fall - lifted);
        let parabola = 0.5 * (fall - rise) / (fall + rise).max(0.001);
        let equiangular = 0.5 * (fall - rise) / fall.max(rise).max(0.001);
        let offset = 0.5 * (parabola + equiangular);
        let curvature = (below + above - 2.0 * here).max(1.0) / f64::from(sgm.paths);
        let disagreement = (back as f64 - offset).abs();
        let spread = config.spread.curvature_px / curvature + 0.1 * (disagreement - 0.5).max(0.0);
        (d as f64 + self.min_px as f64 + offset.clamp(-0.5, 0.5), spread)
    }
}

/// Random volumes with a clear minimum at a random disparity of each block of pixels.
fn volumes(bench: &Bench, min_px: i64) -> Sums {
    let disparities = 16 * bench.whole.groups as usize;
    let mut sums = vec![0; bench.whole.pixels() * disparities];
    for (index, volume) in bench.volumes.sums.iter().enumerate() {
        let mut bytes = bench.fill(volume, 20 + index as u64, 254.99);
        for (pixel, costs) in bytes.chunks_exact_mut(disparities).enumerate() {
            let d = (pixel / 5 * 7) % disparities;
            for (distance, cost) in costs.iter_mut().enumerate().map(|(at, cost)| (at.abs_diff(d), cost)) {
                *cost = *cost / 2 + (distance * 12).min(110) as u8;
            }
        }
        bench.gpu.write(volume, 0, bytemuck::cast_slice(&bytes)).unwrap();
        sums.iter_mut().zip(&bytes).for_each(|(sum, &byte)| *sum += u32::from(byte));
    }
    Sums { width: bench.whole.width as usize, disparities, min_px, sums }
}

fn check(paths: u32, size: (u32, u32), min_px: i32) {
    let mut config = config();
    config.sgm.paths = paths;
    let (left, right) = pair(size, 8, |_, _| 5.0);
    let bench = Bench::new((&left, &right), DisparityRange { min_px, groups: 3 }, config);
    let output = &bench.images.descriptors[0];
    bench.run(&census::bind(&bench.gpu, &bench.uniform, bench.input.left(), output).unwrap(), bench.words());
    let sums = volumes(&bench, min_px.into());
    bench.run(&winner::bind(&bench.gpu, &bench.uniform, 3, &bench.volumes).unwrap(), [size.1, 1, 1]);
    for (pixel, found) in bench.gpu.read(&bench.volumes.left_winners).unwrap().into_iter().enumerate() {
        let (best, d, second) = sums.left(pixel);
        assert_eq!(found, [best << 16 | d as u32, second], "pixel {pixel}, {paths} paths, {size:?}");
    }
    let from_right = bench.gpu.read(&bench.volumes.right_winners).unwrap();
    for (pixel, &found) in from_right.iter().enumerate() {
        let x = (pixel % sums.width) as i64;
        let reached = 0..size.0 as i64 + 47;
        if reached.contains(&(x + i64::from(min_px) + 47)) && x + i64::from(min_px) < size.0.into() {
            assert_eq!(found as usize, sums.right(pixel / sums.width, x), "right pixel {pixel}, {size:?}");
        }
    }
    let acceptance = Acceptance::new(&bench.config);
    let kernel =
        cross_check::bind(&bench.gpu, &bench.uniform, &acceptance, &bench.images, &bench.volumes).unwrap();
    bench.run(&kernel, bench.words());
    let [found, spreads] = [&bench.images.matched, &bench.images.spreads]
        .map(|image| unpadded(&bench.whole, &bench.gpu.read(image).unwrap()));
    let mut accepted = 0;
    for (pixel, (found, spread)) in found.into_iter().zip(spreads).enumerate() {
        let expected = sums.accept(pixel, &bench.config);
        let error = (f64::from(found) - expected.0).abs().max((f64::from(spread) - expected.1).abs());
        assert!(error < 1e-5, "pixel {pixel}: {found} +- {spread}, expected {expected:?}");
        accepted += usize::from(found > NO_DISPARITY);
    }
    assert!(accepted > 20, "{accepted} accepted: the test shows nothing");
}

#[test]
fn winners_of_both_views_and_the_cross_check_equal_the_mirror() {
    check(8, SIZES[0], 0);
    check(4, SIZES[0], -12);
    check(8, SIZES[1], 8);
}
