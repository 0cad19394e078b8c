//! CPU mirror of `descend.wgsl`.

use super::descend;
use super::halve::halved;
use super::testing::{grid, holding, known, planes, shipped_bench};
use crate::disparity::testing::{NO_DISPARITY, SIZES};

#[test]
fn fine_pixels_lie_on_the_plane_of_the_coarse_one_around_them() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let coarse_size = halved(size);
        let given = planes(coarse_size, 81);
        let coarse = holding(&bench, &given);
        let fine = bench.gpu.storage("fine", bench.whole.pixels()).unwrap();
        let kernel = descend::bind(&bench.gpu, &bench.uniform, coarse_size, &coarse, &fine).unwrap();
        bench.run(&kernel, grid(&bench));
        for (index, found) in bench.gpu.read(&fine).unwrap().into_iter().enumerate() {
            let (x, y) = (index as u32 % size.0, index as u32 / size.0);
            let plane = given[(y / 2 * coarse_size.0 + x / 2) as usize];
            if !known(plane[0]) {
                assert_eq!(found, [NO_DISPARITY, 0.0, 0.0, 0.0]);
            } else if plane[0].is_finite() {
                let offset = |at: u32| if at.is_multiple_of(2) { -0.25 } else { 0.25 };
                let value = 2.0 * (plane[0] + plane[1] * offset(x) + plane[2] * offset(y));
                assert!((found[0] - value).abs() < 1e-4, "({x}, {y}): {found:?}, {value}");
                assert_eq!(found[1..], [plane[1], plane[2], 2.0 * plane[3]]);
            }
        }
    }
}
