//! CPU mirror of `check_views.wgsl`.

use super::check_views;
use super::testing::ElasBench;
use crate::disparity::testing::{NO_DISPARITY, SIZES, config, unpadded};
use crate::testing::Numbers;

#[test]
fn a_disparity_stays_where_its_partner_agrees() {
    for size in SIZES {
        let black = geometry::Rgb::filled(size.0, size.1, [0; 3]);
        let bench = ElasBench::new((&black, &black), config());
        let mut numbers = Numbers::new(82);
        let source: Vec<[f32; 2]> = (0..bench.buffers.found.len())
            .map(|index| match index % 7 {
                0 => [NO_DISPARITY, 0.0],
                1 => [f32::NAN, 0.1],
                _ => [10.0 + 3.0 * numbers.next() as f32, 0.2],
            })
            .collect();
        bench.gpu().write(&bench.buffers.found, 0, &source).unwrap();
        let images = &bench.bench.images;
        let kernel = check_views::bind(bench.gpu(), images, &bench.buffers, &images.filtered).unwrap();
        bench.bench.run(&kernel, bench.bench.words());
        let found = unpadded(&bench.bench.whole, &bench.gpu().read(&images.filtered).unwrap());
        let mut kept = 0;
        for (index, found) in found.into_iter().enumerate() {
            let (x, y) = (index as u32 % size.0, index as u32 / size.0);
            let own = source[bench.index(0, x, y)][0];
            let partner = (x as f32 - own).round_ties_even();
            let inside = partner >= 0.0 && partner < size.0 as f32;
            let agrees = inside && (source[bench.index(1, partner as u32, y)][0] - own).abs() <= 2.0;
            kept += u32::from(agrees);
            assert_eq!(found, if agrees { own } else { NO_DISPARITY }, "({x}, {y}) of {size:?}");
        }
        assert!(kept > size.0 * size.1 / 8, "{kept}");
    }
}
