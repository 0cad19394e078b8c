//! CPU mirror of `match_support.wgsl`.

use super::match_support;
use super::testing::{Descriptor, ElasBench, difference, is_silent, texture};
use super::triangulation::NO_SUPPORT;
use crate::disparity::testing::SIZES;

const REACH: i32 = 5;
const INDICES: usize = 48;
const MIN_DISPARITY: i32 = -4;

struct Mirror<'a> {
    bench: &'a ElasBench,
    descriptors: Vec<Descriptor>,
}

impl Mirror<'_> {
    fn corners(&self, view: u32, x: u32, y: u32) -> [Descriptor; 4] {
        let offsets = [(-2, -2), (2, -2), (-2, 2), (2, 2)];
        offsets.map(|(dx, dy)| {
            self.descriptors[self.bench.index(view, x.wrapping_add_signed(dx), y.wrapping_add_signed(dy))]
        })
    }

    /// Index of the only place that is clearly best.
    fn unique(&self, view: u32, x: u32, y: u32) -> Option<usize> {
        let own = self.corners(view, x, y);
        let cost = |index: usize| {
            let partner = self.bench.partner(view, x, MIN_DISPARITY + index as i32)?;
            let inside = (REACH..self.bench.size().0 as i32 - REACH).contains(&(partner as i32));
            let other = inside.then(|| self.corners(1 - view, partner, y))?;
            Some(own.iter().zip(&other).map(|(a, b)| difference(a, b)).sum::<u32>())
        };
        let costs: Vec<Option<u32>> = (0..INDICES).map(cost).collect();
        let known = || costs.iter().enumerate().filter_map(|(index, cost)| cost.map(|cost| (cost, index)));
        let (least, best) = known().min()?;
        let second = known().filter(|&(_, index)| index.abs_diff(best) > 1).map(|(cost, _)| cost).min()?;
        let clear = (least as f32) < self.bench.search.support_threshold * second as f32;
        (clear && best > 0 && best + 1 < INDICES).then_some(best)
    }

    fn has_texture(&self, view: u32, x: u32, y: u32) -> bool {
        let centre = &self.descriptors[self.bench.index(view, x, y)];
        let seen = !self.corners(view, x, y).iter().any(is_silent) && !is_silent(centre);
        seen && texture(centre) >= self.bench.search.support_texture
    }

    fn support(&self, x: u32, y: u32) -> Option<i32> {
        let index = self.has_texture(0, x, y).then(|| self.unique(0, x, y))??;
        let disparity = MIN_DISPARITY + index as i32;
        let partner = self.bench.partner(0, x, disparity)?;
        let back = self.has_texture(1, partner, y).then(|| self.unique(1, partner, y))??;
        (back.abs_diff(index) as f32 <= self.bench.search.lr_threshold).then_some(disparity)
    }
}

#[test]
fn support_points_equal_those_of_the_mirror() {
    for size in SIZES {
        let bench = ElasBench::described(size, 71);
        let kernel = match_support::bind(bench.gpu(), &bench.bench.images, &bench.buffers).unwrap();
        bench.bench.run(&kernel, [bench.search.columns, bench.search.rows, 1]);
        let mirror = Mirror { bench: &bench, descriptors: bench.descriptors() };
        let found = bench.gpu().read(&bench.buffers.support).unwrap();
        let inside = |at: u32, extent: u32| at >= REACH as u32 && (at as i32) < extent as i32 - REACH;
        for (index, &found) in found.iter().enumerate() {
            let step = bench.search.step;
            let (x, y) =
                (index as u32 % bench.search.columns * step, index as u32 / bench.search.columns * step);
            let seen = inside(x, size.0) && inside(y, size.1);
            let expected = seen.then(|| mirror.support(x, y)).flatten().unwrap_or(NO_SUPPORT);
            assert_eq!(found, expected, "({x}, {y}) of {size:?}");
        }
        let points = found.iter().filter(|&&disparity| disparity != NO_SUPPORT).count();
        assert!(size == SIZES[0] || points > 100, "{points} points");
    }
}
