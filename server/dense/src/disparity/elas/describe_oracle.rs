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
fn descriptors_equal_the_mirror_and_pixels_by_a_mask_are_silent() {
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
                let masked = |(dx, dy): (i64, i64)| {
                    // the padding repeats the last column
                    let (x, y) = (i64::from(x) + dx, i64::from(y) + dy);
                    let inside = (0..i64::from(columns)).contains(&x) && (0..size.1.into()).contains(&y);
                    let column = (x as u32).min(size.0 - 1);
                    inside && !(13..250).contains(&luma[(column, y as u32)])
                };
                let seen = x < size.0 && ![(0, 0), (-2, 0), (2, 0), (0, -2), (0, 2)].into_iter().any(masked);
                let expected = if seen { descriptor(&luma, x, y) } else { [0; 16] };
                assert_eq!(found[bench.index(view, x, y)], expected, "({x}, {y}) of {size:?}");
            }
        }
    }
}
