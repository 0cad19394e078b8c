//! CPU mirror of `aggregate.wgsl`: follows each path from where it enters the image.

use geometry::Gray;

use super::DisparityRange;
use super::aggregate::{self, STEPS, Walk};
use super::config::SgmConfig;
use super::testing::{Bench, SIZES, config, pair};

struct Image<'a> {
    luma: &'a Gray,
    costs: &'a [u8],
    disparities: usize,
}

impl Image<'_> {
    fn costs_of(&self, x: i64, y: i64) -> &[u8] {
        let pixel = y as usize * self.luma.width() as usize + x as usize;
        &self.costs[pixel * self.disparities..][..self.disparities]
    }
}

fn penalty(config: &SgmConfig, step: i32) -> i32 {
    let fall = (step * (config.jump_penalty_per_level * 16.0).round() as i32) >> 4;
    (config.jump_penalty_max as i32 - fall).max(config.jump_penalty_min as i32)
}

fn next(image: &Image, config: &SgmConfig, before: &[i32], (x, y): (i64, i64), step: i32) -> Vec<i32> {
    let low = before.iter().copied().min().unwrap();
    let small = config.small_penalty as i32;
    let best = |d: usize| {
        let below = d.checked_sub(1).map(|d| before[d] + small);
        let above = before.get(d + 1).map(|above| above + small);
        let jump = low + penalty(config, step);
        [Some(before[d]), below, above, Some(jump)].into_iter().flatten().min().unwrap()
    };
    let costs = image.costs_of(x, y);
    (0..image.disparities).map(|d| i32::from(costs[d]) + best(d) - low).collect()
}

/// Path costs of all pixels for one direction.
fn path(image: &Image, config: &SgmConfig, (dx, dy): (i32, i32)) -> Vec<i32> {
    let (dx, dy) = (i64::from(dx), i64::from(dy));
    let mut all = vec![0; image.costs.len()];
    let starts = (0..image.luma.height()).flat_map(|y| (0..image.luma.width()).map(move |x| (x, y)));
    for (x, y) in starts {
        let (mut x, mut y) = (i64::from(x), i64::from(y));
        if image.luma.get(x - dx, y - dy).is_some() {
            continue;
        }
        let mut costs: Vec<i32> = image.costs_of(x, y).iter().map(|&cost| cost.into()).collect();
        let mut before = image.luma[(x as u32, y as u32)];
        loop {
            let pixel = y as usize * image.luma.width() as usize + x as usize;
            all[pixel * image.disparities..][..image.disparities].copy_from_slice(&costs);
            (x, y) = (x + dx, y + dy);
            let Some(&here) = image.luma.get(x, y) else { break };
            costs = next(image, config, &costs, (x, y), i32::from(here.abs_diff(before)));
            before = here;
        }
    }
    all
}

#[test]
fn all_paths_equal_the_mirror() {
    for size in SIZES {
        let (left, right) = pair(size, 6, |_, _| 5.3);
        let mut config = config();
        config.sgm.paths = 8;
        let bench = Bench::new((&left, &right), DisparityRange { min_px: 0, groups: 2 }, config);
        let costs = bench.fill(&bench.volumes.costs, 7, 31.99);
        let luma = left.to_gray();
        let image = Image { luma: &luma, costs: &costs, disparities: 32 };
        for (index, step) in STEPS.into_iter().enumerate() {
            let volumes = (bench.input.left(), &bench.volumes);
            let walk = Walk::new(index, &bench.config.sgm);
            let kernel = aggregate::bind(&bench.gpu, &bench.uniform, &walk, (2, index / 2), volumes).unwrap();
            let before = bench.bytes(&bench.volumes.sums[index / 2]);
            bench.run(&kernel, [size.0.max(size.1), 1, 1]);
            let found = bench.bytes(&bench.volumes.sums[index / 2]);
            let expected = path(&image, &bench.config.sgm, step);
            for (place, (&found, expected)) in found.iter().zip(expected).enumerate() {
                let added = if index % 2 == 1 { i32::from(before[place]) } else { 0 };
                assert_eq!(i32::from(found), expected + added, "path {step:?}, place {place}, {size:?}");
            }
        }
    }
}

#[test]
fn the_sum_of_two_paths_fits_a_byte_at_the_largest_penalties_allowed() {
    let mut config = config();
    (config.sgm.small_penalty, config.sgm.jump_penalty_min, config.sgm.jump_penalty_max) = (96, 96, 96);
    config.check().unwrap();
    let black = geometry::Rgb::filled(37, 29, [0; 3]);
    let bench = Bench::new((&black, &black), DisparityRange { min_px: 0, groups: 1 }, config);
    let mut costs = vec![31u8; bench.volumes.costs.len() * 16];
    costs.iter_mut().step_by(16).for_each(|cost| *cost = 0);
    bench.gpu.write(&bench.volumes.costs, 0, bytemuck::cast_slice(&costs)).unwrap();
    for index in 0..2 {
        let walk = Walk::new(index, &bench.config.sgm);
        let volumes = (bench.input.left(), &bench.volumes);
        let kernel = aggregate::bind(&bench.gpu, &bench.uniform, &walk, (1, 0), volumes).unwrap();
        bench.run(&kernel, [37, 1, 1]);
    }
    let middle = 14 * 37 + 18;
    let sums = bench.bytes(&bench.volumes.sums[0]);
    assert_eq!(sums[middle * 16], 0);
    assert_eq!(sums[middle * 16 + 1], 2 * (31 + 96));
}
