//! CPU mirror of `fill_triangles.wgsl`: every pixel asks every triangle.

use geometry::Rgb;

use super::fill_triangles;
use super::testing::ElasBench;
use super::triangulation::{Room, SupportPoint, add_corners, triangles};
use crate::disparity::testing::{SIZES, config};
use crate::testing::Numbers;

/// Whether a pixel lies to the right of all edges; on an edge one of the two directions counts.
fn holds(corners: &[(i32, i32); 3], x: i32, y: i32) -> bool {
    (0..3).all(|k| {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let side = dx * (y - from.1) - dy * (x - from.0);
        side > 0 || (side == 0 && (dy > 0 || (dy == 0 && dx < 0)))
    })
}

#[test]
fn every_pixel_between_the_corners_lies_in_exactly_one_triangle_and_gets_it() {
    for size in SIZES {
        let black = Rgb::filled(size.0, size.1, [0; 3]);
        let bench = ElasBench::new((&black, &black), config());
        let mut numbers = Numbers::new(81);
        let mut within = |extent: u32| ((numbers.next() * 0.5 + 0.5) * f64::from(extent)) as i32;
        let mut points: Vec<SupportPoint> = (0..40)
            .map(|_| SupportPoint { x: within(size.0), y: within(size.1), disparity: within(40) - 3 })
            .collect();
        add_corners(&mut points, size);
        let all = triangles(&points, size.1, Room::new(bench.search.candidates()));
        let gpu = bench.gpu();
        gpu.write(&bench.buffers.corners, 0, &all.corners).unwrap();
        gpu.write(&bench.buffers.strips, 0, &all.strips).unwrap();
        let count = all.strips.len() as u32;
        gpu.write(&bench.buffers.strip_count, 0, &[[count, 0, 0, 0]]).unwrap();
        gpu.write(&bench.buffers.triangle_of, 0, &vec![0; bench.buffers.triangle_of.len()]).unwrap();
        let kernel = fill_triangles::bind(gpu, &bench.bench.images, &bench.buffers).unwrap();
        bench.bench.run(&kernel, [count, 1, 1]);
        let found = gpu.read(&bench.buffers.triangle_of).unwrap();
        let of_view = |view: u32| {
            let mut names: Vec<u32> = all
                .strips
                .iter()
                .filter(|strip| strip[0] >> 31 == view)
                .map(|strip| strip[0] & 0x7fff_ffff)
                .collect();
            names.dedup();
            names
        };
        for (view, names) in [(0, of_view(0)), (1, of_view(1))] {
            for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
                let corners = |name: u32| {
                    let [ab, c] = [all.corners[2 * name as usize], all.corners[2 * name as usize + 1]];
                    [(ab[0], ab[1]), (ab[2], ab[3]), (c[0], c[1])]
                };
                let holding: Vec<u32> =
                    names.iter().copied().filter(|&name| holds(&corners(name), x as i32, y as i32)).collect();
                assert_eq!(holding.len(), 1, "({x}, {y}) of view {view}");
                assert_eq!(found[bench.index(view, x, y)], holding[0] + 1, "({x}, {y}) of view {view}");
            }
        }
    }
}
