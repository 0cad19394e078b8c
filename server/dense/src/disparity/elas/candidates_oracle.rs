//! CPU mirrors of `mark_candidates.wgsl` and `match_candidates.wgsl`.

use super::testing::{ElasBench, difference, is_silent, random_support, texture};
use super::triangulation::NO_SUPPORT;
use super::{mark_candidates, match_candidates};
use crate::disparity::testing::SIZES;
use crate::testing::Numbers;

const LAST: i32 = 47;
const MIN_DISPARITY: i32 = -4;

/// Bit sets of both views, two words a cell.
fn marked(bench: &ElasBench, support: &[i32]) -> Vec<u32> {
    let search = &bench.search;
    let mut words = vec![0u32; search.mask_len()];
    let cells = |position: i32| {
        (position.div_euclid(search.cell as i32) - 1)..=(position.div_euclid(search.cell as i32) + 1)
    };
    for (index, &disparity) in support.iter().enumerate().filter(|(_, disparity)| **disparity != NO_SUPPORT) {
        let x = (index as u32 % search.columns * search.step) as i32;
        let y = (index as u32 / search.columns * search.step) as i32;
        for (view, column) in [(0, x), (1, x - disparity)] {
            for (cx, cy) in cells(y).flat_map(|cy| cells(column).map(move |cx| (cx, cy))) {
                if !(0..search.cell_columns as i32).contains(&cx)
                    || !(0..search.cell_rows as i32).contains(&cy)
                {
                    continue;
                }
                let cell = ((view * search.cell_rows as i32 + cy) * search.cell_columns as i32 + cx) as usize;
                for k in -1..=1 {
                    let k = (disparity - MIN_DISPARITY + k).clamp(0, LAST) as usize;
                    words[cell * search.mask_words as usize + k / 32] |= 1 << (k % 32);
                }
            }
        }
    }
    words
}

#[test]
fn cells_hold_the_disparities_of_the_points_around_them_in_both_views() {
    for size in SIZES {
        let bench = ElasBench::described(size, 74);
        let support = random_support(&bench.search, 75);
        bench.gpu().write(&bench.buffers.plausible, 0, &support).unwrap();
        let kernel = mark_candidates::bind(bench.gpu(), &bench.bench.images, &bench.buffers).unwrap();
        let cells = bench.search.cell_columns * bench.search.cell_rows;
        bench.bench.run(&kernel, [cells * bench.search.mask_words, 2, 1]);
        let found = bench.gpu().read(&bench.buffers.candidates).unwrap();
        assert_eq!(found, marked(&bench, &support), "{size:?}");
    }
}

#[test]
fn the_least_energy_among_the_candidates_equals_that_of_the_mirror() {
    for size in SIZES {
        let bench = ElasBench::described(size, 76);
        let search = &bench.search;
        let mut numbers = Numbers::new(77);
        let mut random = || ((numbers.next() * 0.5 + 0.5) * f64::from(u32::MAX)) as u32;
        // every third cell has none; of the second word only the disparities that exist
        let masks: Vec<u32> = (0..search.mask_len())
            .map(
                |index| {
                    if index / 2 % 3 == 0 { 0 } else { random() & random() & [u32::MAX, 0xffff][index % 2] }
                },
            )
            .collect();
        bench.gpu().write(&bench.buffers.candidates, 0, &masks).unwrap();
        let kernel = match_candidates::bind(bench.gpu(), &bench.bench.images, &bench.buffers).unwrap();
        bench.run_pixels(&kernel);
        let found = bench.gpu().read(&bench.buffers.energies).unwrap();
        let descriptors = bench.descriptors();
        for (view, x, y) in
            (0..2).flat_map(|view| (0..size.1).flat_map(move |y| (0..size.0).map(move |x| (view, x, y))))
        {
            let own = &descriptors[bench.index(view, x, y)];
            let cell = (view * search.cell_rows + y / search.cell) * search.cell_columns + x / search.cell;
            let key = |k: i32| {
                let partner = bench.partner(view, x, MIN_DISPARITY + k)?;
                let cost = difference(own, &descriptors[bench.index(1 - view, partner, y)]);
                Some((4 * cost + search.bonus[0][0]) << 10 | k as u32)
            };
            let is_marked = |k: &i32| masks[2 * cell as usize + (*k / 32) as usize] >> (k % 32) & 1 == 1;
            let matched = !is_silent(own) && texture(own) >= search.match_texture;
            let least = (0..=LAST).filter(is_marked).filter_map(key).min().filter(|_| matched);
            assert_eq!(
                found[bench.index(view, x, y)],
                least.unwrap_or(u32::MAX),
                "({x}, {y}) of view {view}"
            );
        }
    }
}
