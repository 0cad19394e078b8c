//! CPU mirror of `census.wgsl`.

use geometry::Gray;

use super::testing::{Bench, SIZES, config, hostile};
use super::{DisparityRange, census};

/// 31 comparisons of opposite neighbours, from the top left one on.
pub fn descriptor(luma: &Gray, x: i64, y: i64) -> u32 {
    let (right, bottom) = (i64::from(luma.width()) - 1, i64::from(luma.height()) - 1);
    let at = |x: i64, y: i64| luma[(x.clamp(0, right) as u32, y.clamp(0, bottom) as u32)];
    let offsets = (-3..=0i64).flat_map(|dy| (-4..=4i64).map(move |dx| (dx, dy)));
    offsets.take(31).fold(0, |bits, (dx, dy)| bits << 1 | u32::from(at(x + dx, y + dy) > at(x - dx, y - dy)))
}

#[test]
fn descriptors_equal_the_mirror_and_masked_pixels_are_silent() {
    for size in SIZES {
        let image = hostile(size, 3);
        let bench = Bench::new((&image, &image), DisparityRange { min_px: 0, groups: 1 }, config());
        let output = &bench.images.descriptors[0];
        bench.run(
            &census::bind(&bench.gpu, &bench.uniform, bench.input.left(), output).unwrap(),
            bench.words(),
        );
        let found = bench.gpu.read(output).unwrap();
        let luma = image.to_gray();
        for (index, &found) in found.as_flattened().iter().enumerate() {
            let (x, y) = (index as u32 % (4 * bench.whole.words), index as u32 / (4 * bench.whole.words));
            let seen = x < size.0 && (13..250).contains(&luma[(x, y)]);
            let expected = if seen { descriptor(&luma, x.into(), y.into()) } else { 1 << 31 };
            assert_eq!(found, expected, "({x}, {y}) of {size:?}");
        }
    }
}
