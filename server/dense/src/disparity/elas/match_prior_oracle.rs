//! CPU mirror of `match_prior.wgsl` in double precision.

use super::match_prior;
use super::testing::{Descriptor, ElasBench, difference, is_silent, texture};
use crate::disparity::testing::{NO_DISPARITY, SIZES};
use crate::testing::Numbers;

const LAST: i32 = 47;
const MIN_DISPARITY: i32 = -4;

struct Mirror<'a> {
    bench: &'a ElasBench,
    descriptors: Vec<Descriptor>,
}

impl Mirror<'_> {
    fn cost(&self, view: u32, x: u32, y: u32, k: i32) -> Option<u32> {
        let partner = self.bench.partner(view, x, MIN_DISPARITY + k)?;
        let index = |view, x| self.bench.index(view, x, y);
        Some(difference(&self.descriptors[index(view, x)], &self.descriptors[index(1 - view, partner)]))
    }

    fn best(&self, (view, x, y): (u32, u32, u32), energy: u32, plane: [f32; 4]) -> Option<i32> {
        let search = &self.bench.search;
        let planar = plane[0] * x as f32 + plane[1] * y as f32 + plane[2];
        let middle = planar.clamp(-4096.0, 4096.0).round_ties_even() as i32 - MIN_DISPARITY;
        let radius = search.radius;
        let about = (middle - radius).max(0)..=(middle + radius).min(LAST);
        let key = |k: i32| {
            let bonus = search.bonus.as_flattened()[k.abs_diff(middle) as usize];
            let bonus = if plane[3] > 0.0 { bonus } else { 0 };
            Some((4 * self.cost(view, x, y, k)? + search.bonus[0][0] - bonus) << 10 | k as u32)
        };
        let least = about.filter_map(key).fold(energy, u32::min);
        let k = (least & 1023) as i32;
        (least != u32::MAX && k > 0 && k < LAST).then_some(k)
    }

    fn found(&self, at: (u32, u32, u32), energy: u32, triangle: Option<[f32; 4]>) -> Option<[f64; 2]> {
        let (view, x, y) = at;
        let own = &self.descriptors[self.bench.index(view, x, y)];
        let plane =
            triangle.filter(|_| !is_silent(own) && texture(own) >= self.bench.search.match_texture)?;
        let supported = self.bench.search.prior_alone == 1 || energy != u32::MAX;
        let k = supported.then(|| self.best(at, energy, plane))??;
        let disparity = f64::from(MIN_DISPARITY + k);
        if view == 1 {
            return Some([disparity, 0.0]);
        }
        let rise = |step: i32| {
            Some(f64::from(self.cost(view, x, y, k + step)?) - f64::from(self.cost(view, x, y, k)?))
        };
        let (below, above) = (rise(-1)?, rise(1)?);
        let tilt = 0.25 * (below - above);
        let both = (below + above).max(1.0);
        let offset = tilt / both + tilt / below.max(above).max(1.0);
        Some([disparity + offset.clamp(-0.5, 0.5), f64::from(self.bench.search.rise_sigma) / both])
    }
}

#[test]
fn the_most_likely_disparity_equals_that_of_the_mirror_whatever_the_planes() {
    for size in SIZES {
        let bench = ElasBench::described(size, 78);
        let mut numbers = Numbers::new(79);
        let planes: Vec<[f32; 4]> = (0..40)
            .map(|index| match index % 8 {
                6 => [1e6, -1e6, 3e7, 1.0],
                7 => [0.06, 0.03, 4.0, 0.0],
                _ => [0.06 + 0.02 * numbers.next() as f32, 0.03, 4.0 + 3.0 * numbers.next() as f32, 1.0],
            })
            .collect();
        let pixels = bench.buffers.energies.len();
        let triangle_of: Vec<u32> =
            (0..pixels).map(|_| ((numbers.next() * 0.5 + 0.5) * 41.0) as u32).collect();
        let energies: Vec<u32> = (0..pixels)
            .map(|index| match index % 3 {
                0 => u32::MAX,
                _ => (((numbers.next() * 0.5 + 0.5) * 3000.0) as u32) << 10 | (index % 48) as u32,
            })
            .collect();
        bench.gpu().write(&bench.buffers.planes, 0, &planes).unwrap();
        bench.gpu().write(&bench.buffers.triangle_of, 0, &triangle_of).unwrap();
        bench.gpu().write(&bench.buffers.energies, 0, &energies).unwrap();
        bench.run_pixels(&match_prior::bind(bench.gpu(), &bench.bench.images, &bench.buffers).unwrap());
        let mirror = Mirror { bench: &bench, descriptors: bench.descriptors() };
        let found = bench.gpu().read(&bench.buffers.found).unwrap();
        let mut matched = 0;
        for (view, x, y) in
            (0..2).flat_map(|view| (0..size.1).flat_map(move |y| (0..size.0).map(move |x| (view, x, y))))
        {
            let index = bench.index(view, x, y);
            let triangle = triangle_of[index].checked_sub(1).map(|triangle| planes[triangle as usize]);
            let expected = mirror.found((view, x, y), energies[index], triangle);
            matched += usize::from(expected.is_some());
            let expected = expected.unwrap_or([NO_DISPARITY.into(), 0.0]);
            let error = (0..2).map(|k| (f64::from(found[index][k]) - expected[k]).abs()).fold(0.0, f64::max);
            assert!(error < 1e-4, "({x}, {y}) of view {view}: {:?}, expected {expected:?}", found[index]);
        }
        assert!(matched > (size.0 * size.1 / 4) as usize, "{matched}");
    }
}
