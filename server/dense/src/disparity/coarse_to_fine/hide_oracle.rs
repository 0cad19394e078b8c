//! CPU mirror of `hide.wgsl`.

use super::hide::{self, Hiding};
use super::testing::{holding, known, planes, shipped_bench};
use crate::disparity::DisparityRange;
use crate::disparity::testing::{NO_DISPARITY, SIZES};

const TOLERANCE_PX: f64 = 0.7;

#[test]
fn only_what_the_right_eye_can_see_is_left() {
    for size in SIZES {
        let bench = shipped_bench(size);
        let given = planes(size, 95);
        let left = holding(&bench, &given);
        let nearest = bench.gpu.storage("nearest", given.len()).unwrap();
        let range = DisparityRange { min_px: 4, groups: 1 };
        let masked = &bench.input.left().masked;
        let hiding = Hiding::new(range, TOLERANCE_PX);
        let kernel = hide::bind(&bench.gpu, &bench.uniform, &hiding, masked, (&nearest, &left)).unwrap();
        bench.run(&kernel, [size.1, 1, 1]);
        let covered = bench.bytes(masked);
        let partner = |x: usize, d: f32| {
            let column = (x as f32 - d + 0.5).floor();
            (known(d) && column >= 0.0 && column < size.0 as f32).then_some(column as usize)
        };
        let (width, stride) = (size.0 as usize, (size.0 as usize).next_multiple_of(4));
        let mut hidden = 0;
        for (index, found) in bench.gpu.read(&left).unwrap().into_iter().enumerate() {
            let (x, y) = (index % width, index / width);
            let d = given[index][0];
            let row = &given[y * width..(y + 1) * width];
            let in_front = |column: usize| {
                let others =
                    row.iter().enumerate().filter(|(x, plane)| partner(*x, plane[0]) == Some(column));
                others.map(|(_, plane)| plane[0]).fold(NO_DISPARITY, f32::max) > d + TOLERANCE_PX as f32
            };
            let in_range = (4.0..=20.0).contains(&d) && covered[y * stride + x] == 0;
            let seen = in_range && partner(x, d).is_some_and(|column| !in_front(column));
            hidden += usize::from(in_range && !seen);
            let expected = if seen { given[index] } else { [NO_DISPARITY, 0.0, 0.0, 0.0] };
            assert_eq!(found, expected, "({x}, {y}) of {size:?}");
        }
        assert!(hidden > 10, "{hidden} hidden: the test shows nothing");
    }
}
