//! Support points to triangles with their planes: the one part of ELAS that runs on the CPU.

use delaunator::{Point, triangulate};
use nalgebra::{Matrix3, Vector3};

/// No support point at a candidate; as in `search.wgsl`.
pub(super) const NO_SUPPORT: i32 = -32_768;

/// Slope, px per px in either view, from which a plane is no prior (published with the method).
const SLOPE_MAX: f64 = 0.7;

/// Rows of a strip where there is room for strips so short.
const STRIP_ROWS: u32 = 8;

/// How many triangles and strips the buffers hold, of both views together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Room {
    pub triangles: usize,
    pub strips: usize,
}

impl Room {
    /// For as many points as there are candidates, and the corners: a triangulation has less than two triangles a point.
    pub fn new(candidates: usize) -> Self {
        let triangles = 4 * (candidates + 8);
        Self { triangles, strips: 2 * triangles }
    }
}

/// Columns and rows of a triangle's corners.
type Corners = [(i32, i32); 3];

/// One support point, on integer pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SupportPoint {
    pub x: i32,
    pub y: i32,
    pub disparity: i32,
}

/// The triangles of both views as the kernels take them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Triangles {
    /// x0 y0 x1 y1, then x2 y2 0 0.
    pub corners: Vec<[i32; 4]>,
    /// d = x a + y b + c, and 1 where it may be a prior, else 0.
    pub planes: Vec<[f32; 4]>,
    /// Triangle | view << 31, first row, rows, 0.
    pub strips: Vec<[u32; 4]>,
}

/// The grid of candidates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    pub step: i32,
    pub columns: usize,
}

/// The points of the candidates that have a disparity.
pub(super) fn points(disparities: &[i32], lattice: &Lattice) -> Vec<SupportPoint> {
    let place = |(index, &disparity): (usize, &i32)| SupportPoint {
        x: (index % lattice.columns) as i32 * lattice.step,
        y: (index / lattice.columns) as i32 * lattice.step,
        disparity,
    };
    disparities.iter().enumerate().map(place).filter(|point| point.disparity != NO_SUPPORT).collect()
}

/// Adds the corners of both views, just outside the image, each with the disparity of the point nearest to it.
pub(super) fn add_corners(points: &mut Vec<SupportPoint>, (width, height): (u32, u32)) {
    let (right, bottom) = (width as i32, height as i32);
    let nearest = |x: i32, y: i32| {
        let distance = |point: &&SupportPoint| i64::from(point.x - x).pow(2) + i64::from(point.y - y).pow(2);
        points.iter().min_by_key(distance).map(|point| point.disparity)
    };
    let mut corners = Vec::new();
    for y in [-1, bottom] {
        for x in [-1, right] {
            if let Some(disparity) = nearest(x, y) {
                corners.push(SupportPoint { x, y, disparity });
                // the corner of the right view, where that lies outside the left one
                let opposite = if x < 0 { disparity.min(0) - 1 } else { right + disparity.max(0) };
                corners.push(SupportPoint { x: opposite, y, disparity });
            }
        }
    }
    points.extend(corners);
}

/// Triangulates the points in both views.
pub(super) fn triangles(points: &[SupportPoint], height: u32, room: Room) -> Triangles {
    let mut all = Triangles::default();
    let mut rows = Vec::new();
    for view in [0, 1] {
        for triple in delaunay(points, view) {
            let Some((corners, plane)) = oriented(triple, view) else { continue };
            let (top, bottom) = row_range(&corners, height);
            if top <= bottom && all.planes.len() < room.triangles {
                rows.push((view << 31 | all.planes.len() as u32, top, bottom + 1 - top));
                let [a, b, c] = corners;
                all.corners.extend([[a.0, a.1, b.0, b.1], [c.0, c.1, 0, 0]]);
                all.planes.push(plane);
            }
        }
    }
    all.strips = strips(&rows, room.strips);
    all
}

/// Column of a point in a view.
fn column(point: &SupportPoint, view: u32) -> i32 {
    if view == 0 { point.x } else { point.x - point.disparity }
}

/// Delaunay triangulation of the points as a view shows them; of several at one place the nearest surface counts.
fn delaunay(points: &[SupportPoint], view: u32) -> Vec<[SupportPoint; 3]> {
    let mut seen = points.to_vec();
    seen.sort_by_key(|point| (point.y, column(point, view), -point.disparity));
    seen.dedup_by_key(|point| (point.y, column(point, view)));
    let places: Vec<Point> =
        seen.iter().map(|point| Point { x: column(point, view).into(), y: point.y.into() }).collect();
    triangulate(&places).triangles.chunks_exact(3).map(|of| [seen[of[0]], seen[of[1]], seen[of[2]]]).collect()
}

/// Corners with the inside to the right of each edge on the screen, and the plane; `None` for points on one line.
fn oriented([a, b, c]: [SupportPoint; 3], view: u32) -> Option<(Corners, [f32; 4])> {
    let at = |point: &SupportPoint| (i64::from(column(point, view)), i64::from(point.y));
    let (p, q, r) = (at(&a), at(&b), at(&c));
    let doubled_area = (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0);
    let plane = plane([a, b, c], view)?;
    let corner = |point: &SupportPoint| (column(point, view), point.y);
    match doubled_area {
        0 => None,
        1.. => Some(([corner(&a), corner(&b), corner(&c)], plane)),
        _ => Some(([corner(&a), corner(&c), corner(&b)], plane)),
    }
}

/// d = x a + y b + c through three points of a view, and whether it is flat enough in both views to be a prior.
fn plane(points: [SupportPoint; 3], view: u32) -> Option<[f32; 4]> {
    let solve = |view: u32| {
        let rows = points
            .map(|point| Vector3::new(column(&point, view).into(), f64::from(point.y), 1.0).transpose());
        let disparities = Vector3::from(points.map(|point| f64::from(point.disparity)));
        Matrix3::from_rows(&rows).lu().solve(&disparities)
    };
    let own = solve(view)?;
    // the other view may see the triangle from its edge: then it is too steep
    let steep = |slopes: Option<Vector3<f64>>| slopes.is_none_or(|plane| plane.x.abs() >= SLOPE_MAX);
    let usable = if steep(Some(own)) || steep(solve(1 - view)) { 0.0 } else { 1.0 };
    Some([own.x as f32, own.y as f32, own.z as f32, usable])
}

/// The rows of the image, first and last, between a triangle's corners; empty outside of it.
fn row_range(corners: &Corners, height: u32) -> (u32, u32) {
    let top = corners.iter().map(|corner| corner.1).fold(i32::MAX, i32::min).max(0);
    let bottom = corners.iter().map(|corner| corner.1).fold(i32::MIN, i32::max).min(height as i32 - 1);
    if top > bottom { (1, 0) } else { (top as u32, bottom as u32) }
}

/// Cuts triangles (name, first row, rows) into strips, of as few rows as there is room for.
fn strips(triangles: &[(u32, u32, u32)], room: usize) -> Vec<[u32; 4]> {
    let count =
        |rows: u32| triangles.iter().map(|triangle| triangle.2.div_ceil(rows) as usize).sum::<usize>();
    let mut rows = STRIP_ROWS;
    while count(rows) > room {
        rows *= 2;
    }
    let cut = |&(name, first, height): &(u32, u32, u32)| {
        (0..height.div_ceil(rows)).map(move |piece| {
            let start = piece * rows;
            [name, first + start, rows.min(height - start), 0]
        })
    };
    triangles.iter().flat_map(cut).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(disparity: impl Fn(i32, i32) -> i32) -> Vec<SupportPoint> {
        let places = (0..4).flat_map(|j| (0..4).map(move |i| (10 * i, 10 * j)));
        places.map(|(x, y)| SupportPoint { x, y, disparity: disparity(x, y) }).collect()
    }

    #[test]
    fn planes_go_through_their_points_in_both_views() {
        let points = square(|x, y| 5 + x / 5 + y / 10);
        let all = triangles(&points, 31, Room::new(100));
        for (corners, plane) in all.corners.chunks(2).zip(&all.planes) {
            let [ab, c] = [corners[0], corners[1]];
            for (x, y) in [(ab[0], ab[1]), (ab[2], ab[3]), (c[0], c[1])] {
                let disparity = plane[0] * x as f32 + plane[1] * y as f32 + plane[2];
                let as_left =
                    points.iter().any(|p| (p.x, p.y, p.disparity as f32) == (x, y, disparity.round()));
                let as_right = points
                    .iter()
                    .any(|p| (p.x - p.disparity, p.y, p.disparity as f32) == (x, y, disparity.round()));
                assert!(as_left || as_right, "({x}, {y}): {disparity}");
                assert!((disparity - disparity.round()).abs() < 1e-4);
            }
            assert_eq!(plane[3], 1.0);
        }
        assert_eq!(all.planes.len(), 2 * 18);
    }

    #[test]
    fn a_triangle_that_is_steep_in_either_view_is_no_prior() {
        // 0.5 px per px on the left is 1 px per px on the right
        let all = triangles(&square(|x, _| x / 2), 31, Room::new(100));
        assert!(!all.planes.is_empty() && all.planes.iter().all(|plane| plane[3] == 0.0));
    }

    #[test]
    fn points_on_one_line_or_at_one_place_give_no_triangle() {
        let line: Vec<_> = (0..5).map(|x| SupportPoint { x, y: 7, disparity: 3 }).collect();
        let heap = vec![SupportPoint { x: 4, y: 4, disparity: 1 }; 9];
        for points in [Vec::new(), line, heap] {
            assert_eq!(triangles(&points, 31, Room::new(100)), Triangles::default());
        }
    }

    #[test]
    fn strips_grow_where_there_is_little_room() {
        let all = [(0, 0, 100), (1, 5, 33), (2, 90, 1)];
        for room in [4, 7, 100] {
            let strips = strips(&all, room);
            assert!(strips.len() <= room);
            for (name, first, rows) in all {
                let of_triangle: Vec<_> = strips.iter().filter(|strip| strip[0] == name).collect();
                assert_eq!(of_triangle[0][1], first);
                assert_eq!(of_triangle.iter().map(|strip| strip[2]).sum::<u32>(), rows);
            }
        }
    }
}
