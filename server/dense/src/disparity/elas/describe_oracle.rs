//! CPU mirror of `describe.wgsl`.

use geometry::Gray;

use super::sobel_oracle::responses;
use super::testing::{Descriptor, ElasBench};
use super::{describe, sobel};
use crate::disparity::testing::{SIZES, config, hostile};

const HORIZONTAL: [(i64, i64); 12] =
    [(0, -2), (-2, -1), (0, -1), (2, -1), (-1, 0), (0, 0), (0, 0), (1, 0), (-2, 1), (0, 1), (2, 1), (0, 2)];
const VERTICAL: [(i64, i64); 4] = [(0, -1), (-1, 0), (1, 0), (0, 1)];

fn descriptor(luma: &Gray, x: u32, y: u32) -> Descriptor {
    let padded = i64::from(luma.width().next_multiple_of(4)) - 1;
    let bottom = i64::from(luma.height()) - 1;
    let at = |(dx, dy): (i64, i64), axis: usize| {
        responses(luma, (i64::from(x) + dx).clamp(0, padded), (i64::from(y) + dy).clamp(0, bottom))[axis]
    };
    let mut result = [0; 16];
    let all = HORIZONTAL.map(|offset| (offset, 0)).into_iter().chain(VERTICAL.map(|offset| (offset, 1)));
    result.iter_mut().zip(all).for_each(|(byte, (offset, axis))| *byte = at(offset, axis));
    result
}

#[test]
fn descriptors_equal_the_mirror_and_masked_pixels_are_silent() {
    for size in SIZES {
        let eyes = [hostile(size, 63), hostile(size, 64)];
        let bench = ElasBench::new((&eyes[0], &eyes[1]), config());
        let (images, input) = (&bench.bench.images, &bench.bench.input);
        bench.run_images(&sobel::bind(bench.gpu(), images, input, &bench.buffers).unwrap());
        bench.run_images(&describe::bind(bench.gpu(), images, input, &bench.buffers).unwrap());
        let found = bench.descriptors();
        for (view, eye) in (0..).zip(&eyes) {
            let luma = eye.to_gray();
            let columns = size.0.next_multiple_of(4);
            for (x, y) in (0..size.1).flat_map(|y| (0..columns).map(move |x| (x, y))) {
                let seen = x < size.0 && (13..250).contains(&luma[(x, y)]);
                let expected = if seen { descriptor(&luma, x, y) } else { [0; 16] };
                assert_eq!(found[bench.index(view, x, y)], expected, "({x}, {y}) of {size:?}");
            }
        }
    }
}
