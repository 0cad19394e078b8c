//! CPU mirror of `high_pass.wgsl`.

use super::high_pass::{self, ROWS};
use super::testing::shipped_bench;
use crate::disparity::testing::SIZES;

#[test]
fn what_passes_is_the_difference_to_the_mean_of_seven_by_seven() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let source = &bench.input.left().grey;
        let passed = bench.gpu.storage("high pass", bench.whole.pixels()).unwrap();
        let kernel = high_pass::bind(&bench.gpu, &bench.uniform, source, &passed).unwrap();
        bench.run(&kernel, [bench.whole.words, size.1.div_ceil(ROWS), 1]);
        let grey = bench.gpu.read(source).unwrap();
        let at = |x: i64, y: i64| {
            let (x, y) = (x.clamp(0, i64::from(size.0) - 1), y.clamp(0, i64::from(size.1) - 1));
            f64::from(grey[(y * i64::from(size.0) + x) as usize])
        };
        for (index, &found) in bench.gpu.read(&passed).unwrap().iter().enumerate() {
            let (x, y) = (index as i64 % i64::from(size.0), index as i64 / i64::from(size.0));
            let around = (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (x + dx, y + dy)));
            let expected = at(x, y) - around.map(|(x, y)| at(x, y)).sum::<f64>() / 49.0;
            assert!(
                (f64::from(found) - expected).abs() < 2e-3,
                "({x}, {y}) of {size:?}: {found}, {expected}"
            );
        }
    }
}
