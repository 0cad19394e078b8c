//! Cellular (Worley) noise: lobules of fat and liver.

use nalgebra::Vector3;

use super::noise::{Lattice, floor_fraction};

/// Greatest displacement of a lobule's middle from its cell's.
const SPREAD: f32 = 0.42;

/// The cell and its neighbours, near ones first.
const OFFSETS: [(i32, i32, i32); 27] = [
    (0, 0, 0),
    (-1, 0, 0),
    (1, 0, 0),
    (0, -1, 0),
    (0, 1, 0),
    (0, 0, -1),
    (0, 0, 1),
    (-1, -1, 0),
    (1, -1, 0),
    (-1, 1, 0),
    (1, 1, 0),
    (-1, 0, -1),
    (1, 0, -1),
    (-1, 0, 1),
    (1, 0, 1),
    (0, -1, -1),
    (0, 1, -1),
    (0, -1, 1),
    (0, 1, 1),
    (-1, -1, -1),
    (1, -1, -1),
    (-1, 1, -1),
    (1, 1, -1),
    (-1, -1, 1),
    (1, -1, 1),
    (-1, 1, 1),
    (1, 1, 1),
];

/// Where a point lies in its lobule.
#[derive(Clone, Copy)]
pub(crate) struct Lobule {
    /// Distance to the border in cells, 0 on it.
    pub border: f32,
    /// From the lobule's middle to the point, in cells.
    pub from_middle: Vector3<f32>,
    /// A value in -1..1 of the whole lobule.
    pub value: f32,
}

/// The lobule around a point in cells.
pub(crate) fn lobule(lattice: &Lattice, point: Vector3<f32>) -> Lobule {
    let (x, fx) = floor_fraction(point.x);
    let (y, fy) = floor_fraction(point.y);
    let (z, fz) = floor_fraction(point.z);
    let mut nearest = (f32::INFINITY, Vector3::zeros(), 0.0);
    let mut second = f32::INFINITY;
    let (gap_x, gap_y, gap_z) = (gaps(fx), gaps(fy), gaps(fz));
    for (dx, dy, dz) in OFFSETS {
        let gap = |gaps: [f32; 3], offset: i32| gaps[(offset + 1) as usize];
        if gap(gap_x, dx) + gap(gap_y, dy) + gap(gap_z, dz) >= second {
            continue;
        }
        let (nx, ny, nz) = (x + dx, y + dy, z + dz);
        let random = lattice.node(nx, ny, nz);
        let middle = Vector3::new(
            dx as f32 + 0.5 + SPREAD * random,
            dy as f32 + 0.5 + SPREAD * digits(random, 61.0),
            dz as f32 + 0.5 + SPREAD * digits(random, 1723.0),
        );
        let from_middle = Vector3::new(fx, fy, fz) - middle;
        let distance = from_middle.norm_squared();
        if distance < nearest.0 {
            second = nearest.0;
            nearest = (distance, from_middle, digits(random, 7919.0));
        } else if distance < second {
            second = distance;
        }
    }
    let border = 0.5 * (second.sqrt() - nearest.0.sqrt());
    Lobule { border, from_middle: nearest.1, value: nearest.2 }
}

/// Another value in -1..1 from the later digits of a random one.
fn digits(random: f32, shift: f32) -> f32 {
    2.0 * floor_fraction(random * shift).1 - 1.0
}

/// Squared distances along one axis to where the middles of the cell before, of this and of the next cell can lie.
fn gaps(fraction: f32) -> [f32; 3] {
    let margin = 0.5 - SPREAD;
    let squared = |distance: f32| distance * distance;
    [squared(fraction + margin), 0.0, squared(1.0 - fraction + margin)]
}
