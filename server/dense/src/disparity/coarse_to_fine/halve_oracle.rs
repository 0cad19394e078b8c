//! CPU mirror of `halve.wgsl`.

use super::halve::{self, halved};
use super::testing::shipped_bench;
use crate::disparity::testing::SIZES;

#[test]
fn halves_equal_the_mirror_into_the_padding_and_beyond_odd_sides() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let fine = bench.input.left();
        let (width, height) = halved(size);
        let eye = fine.resized(&bench.gpu, (width, height)).unwrap();
        bench.run(&halve::bind(&bench.gpu, size, fine, &eye).unwrap(), [width.div_ceil(4), height, 1]);
        let fine_grey = bench.gpu.read(&fine.grey).unwrap();
        let fine_masked = bench.bytes(&fine.masked);
        let four = |x: u32, y: u32| {
            [(0, 0), (1, 0), (0, 1), (1, 1)]
                .map(|(dx, dy)| ((2 * x + dx).min(size.0 - 1), (2 * y + dy).min(size.1 - 1)))
        };
        let mean = |x: u32, y: u32| {
            four(x, y).iter().map(|&(x, y)| f64::from(fine_grey[(y * size.0 + x) as usize])).sum::<f64>()
                / 4.0
        };
        let grey = bench.gpu.read(&eye.grey).unwrap();
        for (index, &found) in grey.iter().enumerate() {
            let (x, y) = (index as u32 % width, index as u32 / width);
            assert!((f64::from(found) - mean(x, y)).abs() < 1e-4, "({x}, {y}): {found}");
        }
        let stride = width.next_multiple_of(4);
        let bytes = bench.bytes(&eye.luma).into_iter().zip(bench.bytes(&eye.masked));
        for (index, (luma, masked)) in bytes.enumerate() {
            let (x, y) = ((index as u32 % stride).min(width - 1), index as u32 / stride);
            assert!((f64::from(luma) - mean(x, y)).abs() < 0.501, "({x}, {y}): {luma}");
            let fine_stride = size.0.next_multiple_of(4);
            let covered =
                four(x, y).into_iter().filter(|&(x, y)| fine_masked[(y * fine_stride + x) as usize] != 0);
            assert_eq!(masked, u8::from(covered.count() > 2), "({x}, {y})");
        }
    }
}
