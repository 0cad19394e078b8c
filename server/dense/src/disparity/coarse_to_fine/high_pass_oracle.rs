//! CPU mirror of `high_pass.wgsl`.

use super::high_pass::{self, ROWS};
use super::testing::shipped_bench;
use crate::disparity::testing::SIZES;

/// The two values of a word, grey levels; -256 where masked.
fn unpack(word: u32) -> [f64; 2] {
    [word as u16, (word >> 16) as u16].map(|bits| 256.0 * f64::from(bits as i16) / 32767.0)
}

#[test]
fn what_passes_is_the_difference_to_the_mean_of_seven_by_seven_in_pairs() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let source = bench.input.left();
        let passed = bench.gpu.storage("high pass", bench.whole.pixels()).unwrap();
        let kernel = high_pass::bind(&bench.gpu, &bench.uniform, source, &passed).unwrap();
        bench.run(&kernel, [bench.whole.words, size.1.div_ceil(ROWS), 1]);
        let grey = bench.gpu.read(&source.grey).unwrap();
        let masked = bench.bytes(&source.masked);
        let (width, height) = (i64::from(size.0), i64::from(size.1));
        let at = |x: i64, y: i64| {
            f64::from(grey[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize])
        };
        let expected = |x: i64, y: i64| {
            let stride = i64::from(4 * bench.whole.words);
            if masked[(y * stride + x.min(stride - 1)) as usize] != 0 {
                return -256.0;
            }
            let around = (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (x + dx, y + dy)));
            at(x, y) - around.map(|(x, y)| at(x, y)).sum::<f64>() / 49.0
        };
        let (mut seen, mut covered) = (0, 0);
        for (index, &found) in bench.gpu.read(&passed).unwrap().iter().enumerate() {
            let (x, y) = (index as i64 % width, index as i64 / width);
            let found = unpack(found);
            // the last column's right neighbour lies beyond the image, where nothing reads it
            for (found, x) in found.into_iter().zip(x..(x + 2).min(width)) {
                let expected = expected(x, y);
                assert!((found - expected).abs() < 0.01, "({x}, {y}) of {size:?}: {found}, {expected}");
                covered += usize::from(expected <= -256.0);
                seen += 1;
            }
        }
        assert!(covered > 0 && covered < seen / 2, "{covered} of {seen} masked");
    }
}
