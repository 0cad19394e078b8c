//! CPU mirror of `matching_cost.wgsl`.

use super::testing::{Bench, SIZES, config, hostile};
use super::{DisparityRange, census, matching_cost};

const SILENT: u32 = 1 << 31;

fn cost(left: u32, right: Option<u32>, silent_cost: u8) -> u8 {
    match right {
        Some(right) if (left | right) & SILENT == 0 => (left ^ right).count_ones() as u8,
        _ => silent_cost,
    }
}

#[test]
fn costs_equal_the_mirror_also_where_partners_lie_outside() {
    for (size, min_px) in SIZES.into_iter().zip([-20, 8]) {
        let (left, right) = (hostile(size, 4), hostile(size, 5));
        let bench = Bench::new((&left, &right), DisparityRange { min_px, groups: 3 }, config());
        let eyes = [bench.input.left(), bench.input.right()];
        for (eye, output) in eyes.into_iter().zip(&bench.images.descriptors) {
            bench.run(&census::bind(&bench.gpu, &bench.uniform, eye, output).unwrap(), bench.words());
        }
        let silent = bench.config.sgm.silent_cost;
        let kernel =
            matching_cost::bind(&bench.gpu, &bench.uniform, silent, &bench.images, &bench.volumes).unwrap();
        bench.run(&kernel, bench.words());
        let [left, right] = [0, 1].map(|eye| bench.gpu.read(&bench.images.descriptors[eye]).unwrap());
        let stride = 4 * bench.whole.words;
        for (index, found) in bench.bytes(&bench.volumes.costs).into_iter().enumerate() {
            let (d, pixel) = (index as i32 % 48, index as u32 / 48);
            let (x, y) = (pixel % size.0, pixel / size.0);
            let partner = x as i32 - min_px - d;
            let inside = partner >= 0 && partner < size.0 as i32;
            let of_right = inside.then(|| right.as_flattened()[(y * stride) as usize + partner as usize]);
            let expected = cost(left.as_flattened()[(y * stride + x) as usize], of_right, silent as u8);
            assert_eq!(found, expected, "({x}, {y}), disparity {d}, {size:?}");
        }
    }
}
