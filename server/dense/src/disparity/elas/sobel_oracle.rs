//! CPU mirror of `sobel.wgsl`.

use geometry::Gray;

use super::sobel;
use super::testing::{ElasBench, clamped};
use crate::disparity::testing::{SIZES, config, hostile};

/// Horizontal and vertical response, 128 added.
pub fn responses(luma: &Gray, x: i64, y: i64) -> [u8; 2] {
    let at = |dx: i64, dy: i64| clamped(luma, x + dx, y + dy);
    let weights = [(-1, 1), (0, 2), (1, 1)];
    let along_x: i32 = weights.iter().map(|&(dy, weight)| weight * (at(1, dy) - at(-1, dy))).sum();
    let along_y: i32 = weights.iter().map(|&(dx, weight)| weight * (at(dx, 1) - at(dx, -1))).sum();
    [along_x, along_y].map(|sum| (sum + 128).clamp(0, 255) as u8)
}

#[test]
fn responses_equal_the_mirror_in_both_eyes_up_to_the_border() {
    for size in SIZES {
        let eyes = [hostile(size, 61), hostile(size, 62)];
        let bench = ElasBench::new((&eyes[0], &eyes[1]), config());
        let kernel = sobel::bind(bench.gpu(), &bench.bench.images, &bench.bench.input, &bench.buffers);
        bench.run_images(&kernel.unwrap());
        let found = bench.gpu().read(&bench.buffers.responses).unwrap();
        for (view, eye) in (0..).zip(&eyes) {
            let luma = eye.to_gray();
            for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
                let index = bench.index(view, x, y);
                let of_word = found[index / 4].map(|word| word.to_le_bytes()[index % 4]);
                assert_eq!(of_word, responses(&luma, x.into(), y.into()), "({x}, {y}) of {size:?}");
            }
        }
    }
}
