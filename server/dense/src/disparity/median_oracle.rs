//! CPU mirror of `median.wgsl`.

use super::testing::{Bench, NO_DISPARITY, SIZES, config, padded, unpadded};
use super::{DisparityRange, median};
use crate::testing::Numbers;

fn median_of(values: &[f32], size: (u32, u32), x: i64, y: i64) -> f32 {
    let at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && x < size.0.into() && y < size.1.into();
        inside.then(|| values[(y * i64::from(size.0) + x) as usize]).filter(|&value| value > NO_DISPARITY)
    };
    let Some(own) = at(x, y) else { return NO_DISPARITY };
    let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
    let mut known: Vec<f32> = around.filter_map(|(x, y)| at(x, y)).collect();
    known.sort_by(f32::total_cmp);
    match known.len() {
        0..3 => NO_DISPARITY,
        3..5 => own,
        count => known[count / 2],
    }
}

#[test]
fn the_median_equals_a_sort_with_any_number_of_unknown_neighbours() {
    for size in SIZES {
        let black = geometry::Rgb::filled(size.0, size.1, [0; 3]);
        let bench = Bench::new((&black, &black), DisparityRange { min_px: 0, groups: 1 }, config());
        let mut numbers = Numbers::new(9);
        let source = padded(&bench.whole, |x, _| {
            let unknown = numbers.next() * 0.5 + 0.5 < f64::from(x) / f64::from(size.0);
            if unknown { NO_DISPARITY } else { (20.0 * numbers.next()) as f32 }
        });
        bench.gpu.write(&bench.images.matched, 0, &source).unwrap();
        bench.run(&median::bind(&bench.gpu, &bench.images).unwrap(), bench.words());
        let found = unpadded(&bench.whole, &bench.gpu.read(&bench.images.filtered).unwrap());
        let values = unpadded(&bench.whole, &source);
        for (index, found) in found.into_iter().enumerate() {
            let (x, y) = (index as i64 % i64::from(size.0), index as i64 / i64::from(size.0));
            assert_eq!(found, median_of(&values, size, x, y), "({x}, {y}) of {size:?}");
        }
    }
}
