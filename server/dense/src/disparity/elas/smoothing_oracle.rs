//! CPU mirrors of `close_gaps.wgsl` and `adaptive_mean.wgsl`.

use geometry::Rgb;

use super::adaptive_mean::{self, Direction};
use super::close_gaps::{self, Gaps};
use super::testing::ElasBench;
use crate::disparity::testing::{NO_DISPARITY, SIZES, config, padded, unpadded};
use crate::testing::Numbers;

/// A disparity image with an edge, holes and noise, and its bench, of which every eleventh pixel is masked.
fn scene(size: (u32, u32)) -> (ElasBench, Vec<[f32; 4]>) {
    let spotted = Rgb::from_fn(size.0, size.1, |x, y| [if (x + 3 * y) % 11 == 0 { 255 } else { 99 }; 3]);
    let bench = ElasBench::new((&spotted, &spotted), config());
    let mut numbers = Numbers::new(83);
    let values = padded(&bench.bench.whole, |x, y| {
        let edge = if x > y + 10 { 6.0 } else { 0.0 };
        let hole = numbers.next() > 0.2;
        if hole { NO_DISPARITY } else { 20.0 + edge + 0.05 * x as f32 + 2.0 * numbers.next() as f32 }
    });
    (bench, values)
}

/// The values of a line through (x, y), `reach` to each side, with unknown ones beyond the image.
fn line(values: &[f32], size: (u32, u32), (x, y): (u32, u32), along_columns: bool, reach: i64) -> Vec<f32> {
    let at = |offset: i64| {
        let (dx, dy) = if along_columns { (0, offset) } else { (offset, 0) };
        let (x, y) = (i64::from(x) + dx, i64::from(y) + dy);
        let inside = x >= 0 && y >= 0 && x < size.0.into() && y < size.1.into();
        if inside { values[(y * i64::from(size.0) + x) as usize] } else { NO_DISPARITY }
    };
    (-reach..=reach).map(at).collect()
}

#[test]
fn gaps_are_closed_between_their_ends_up_to_their_longest_width() {
    for (size, along_columns) in SIZES.into_iter().flat_map(|size| [(size, false), (size, true)]) {
        let (bench, source) = scene(size);
        let images = &bench.bench.images;
        bench.gpu().write(&images.filtered, 0, &source).unwrap();
        bench.gpu().write(&images.spreads, 0, &vec![[0.25; 4]; source.len()]).unwrap();
        let gaps = Gaps { width_max: 3, along_columns: along_columns.into(), padding: [0; 2] };
        let pair = [&images.filtered, &images.matched];
        let kernel = close_gaps::bind(bench.gpu(), &gaps, images, bench.bench.input.left(), pair).unwrap();
        bench.bench.run(&kernel, bench.bench.words());
        let values = unpadded(&bench.bench.whole, &source);
        let found = unpadded(&bench.bench.whole, &bench.gpu().read(&images.matched).unwrap());
        let spreads = unpadded(&bench.bench.whole, &bench.gpu().read(&images.spreads).unwrap());
        let mut closed = 0;
        for (index, &found) in found.iter().enumerate() {
            let (x, y) = (index as u32 % size.0, index as u32 / size.0);
            let around = line(&values, size, (x, y), along_columns, 3);
            let before = (1..=3).find(|&step| around[3 - step] > NO_DISPARITY);
            let after = (1..=3).find(|&step| around[3 + step] > NO_DISPARITY);
            let short = before.zip(after).filter(|(before, after)| before + after - 1 <= 3);
            let fillable = values[index] == NO_DISPARITY && (x + 3 * y) % 11 != 0;
            let (expected, spread) = match short.filter(|_| fillable) {
                None => (values[index], 0.25),
                Some((before, after)) => {
                    let (a, b) = (around[3 - before], around[3 + after]);
                    closed += 1;
                    (if (a - b).abs() < 3.0 { 0.5 * (a + b) } else { a.min(b) }, 0.25 + 0.5 * (a - b).abs())
                }
            };
            assert!((found - expected).abs() < 1e-4, "({x}, {y}) of {size:?}: {found}, expected {expected}");
            let known = expected > NO_DISPARITY;
            assert!(
                !known || (spreads[index] - spread).abs() < 1e-4,
                "({x}, {y}): spread {}",
                spreads[index]
            );
        }
        assert!(closed > 100, "{closed}");
    }
}

#[test]
fn the_adaptive_mean_equals_a_weighted_mean() {
    for (size, along_columns) in SIZES.into_iter().flat_map(|size| [(size, false), (size, true)]) {
        let (bench, source) = scene(size);
        let images = &bench.bench.images;
        bench.gpu().write(&images.filtered, 0, &source).unwrap();
        let direction = Direction { along_columns: along_columns.into(), padding: [0; 3] };
        let pair = [&images.filtered, &images.matched];
        let kernel = adaptive_mean::bind(bench.gpu(), &direction, images, pair).unwrap();
        bench.bench.run(&kernel, bench.bench.words());
        let values = unpadded(&bench.bench.whole, &source);
        let found = unpadded(&bench.bench.whole, &bench.gpu().read(&images.matched).unwrap());
        for (index, &found) in found.iter().enumerate() {
            let at = (index as u32 % size.0, index as u32 / size.0);
            let own = f64::from(values[index]);
            let (mut weights, mut sum) = (0.0, 0.0);
            for value in line(&values, size, at, along_columns, 4).into_iter().map(f64::from) {
                let weight = (4.0 - (value - own).abs()).max(0.0);
                weights += weight;
                sum += weight * value;
            }
            let expected = if values[index] == NO_DISPARITY { own } else { sum / weights };
            assert!((f64::from(found) - expected).abs() < 1e-3, "{at:?}: {found}, expected {expected}");
        }
    }
}
