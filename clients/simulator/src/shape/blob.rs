//! A bent, lobed, furrowed ellipsoid, meshed as a cube projected on a sphere.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use nalgebra::{Point3, Rotation3, Vector3};

use super::{Patch, Relief};
use crate::texture::Lattice;

/// A smooth swelling of the surface around a direction.
pub(crate) struct Swelling {
    /// In the body's frame.
    pub direction: Vector3<f64>,
    /// Share of the radius; negative for a hollow.
    pub height: f64,
    /// Angular size, radians.
    pub width_rad: f64,
}

/// A furrow where a plane cuts the surface.
#[derive(Clone, Copy)]
pub(crate) struct Furrow {
    /// Normal of the plane in the body's frame.
    pub normal: Vector3<f64>,
    /// Distance of the plane from the centre.
    pub offset_mm: f64,
    /// Depth in the middle; negative for a ridge.
    pub depth_mm: f64,
    /// Half width.
    pub width_mm: f64,
}

/// An organ as a star-shaped surface.
pub(crate) struct Blob {
    pub centre_mm: Point3<f64>,
    pub world_from_body: Rotation3<f64>,
    pub semi_axes_mm: Vector3<f64>,
    /// How far both ends of the x axis are bent towards y.
    pub bend_mm: f64,
    pub swellings: Vec<Swelling>,
    pub furrows: Vec<Furrow>,
    pub relief: Relief,
}

impl Furrow {
    /// 1 in the middle of the furrow, 0 away from it.
    pub fn closeness(&self, point_in_body_mm: &Vector3<f64>) -> f64 {
        let distance = self.normal.dot(point_in_body_mm) / self.normal.norm() - self.offset_mm;
        (-(distance / self.width_mm).powi(2)).exp()
    }
}

impl Blob {
    /// The surface along a unit direction of the unbent, unit-radius body.
    fn surface(&self, lattice: &Lattice, direction: &Vector3<f64>) -> Point3<f64> {
        let swelling = |s: &Swelling| {
            let angle = direction.angle(&s.direction);
            s.height * (-(angle / s.width_rad).powi(2)).exp()
        };
        let radius = 1.0 + self.swellings.iter().map(swelling).sum::<f64>();
        let smooth = direction.component_mul(&self.semi_axes_mm) * radius;
        let furrow_mm: f64 = self.furrows.iter().map(|f| f.depth_mm * f.closeness(&smooth)).sum();
        let height_mm = self.relief.height_mm(lattice, &self.in_world(&smooth)) - furrow_mm;
        let outward = direction.component_div(&self.semi_axes_mm).normalize();
        self.in_world(&(smooth + outward * height_mm))
    }

    fn in_world(&self, unbent: &Vector3<f64>) -> Point3<f64> {
        let bend = self.bend_mm * (unbent.x / self.semi_axes_mm.x).powi(2);
        self.centre_mm + self.world_from_body * (unbent + Vector3::y() * bend)
    }

    /// A point of the world in the body's frame with the bend taken out.
    pub fn unbent(&self, point_mm: &Point3<f64>) -> Vector3<f64> {
        let bent = self.world_from_body.inverse() * (point_mm - self.centre_mm);
        bent - Vector3::y() * (self.bend_mm * (bent.x / self.semi_axes_mm.x).powi(2))
    }

    pub(super) fn project(&self, lattice: &Lattice, point_mm: &Point3<f64>) -> Point3<f64> {
        let direction = self.unbent(point_mm).component_div(&self.semi_axes_mm);
        self.surface(lattice, &direction.try_normalize(1e-12).unwrap_or_else(Vector3::x))
    }

    pub(super) fn outward(&self, point_mm: &Point3<f64>) -> Vector3<f64> {
        let square = self.semi_axes_mm.component_mul(&self.semi_axes_mm);
        let direction = self.unbent(point_mm).component_div(&square);
        self.world_from_body * direction.try_normalize(1e-12).unwrap_or_else(Vector3::x)
    }

    pub(super) fn patch(&self, lattice: &Lattice, edge_mm: f64) -> Patch {
        let cells = (FRAC_PI_2 * self.semi_axes_mm.max() / edge_mm).ceil().max(2.0) as usize;
        let mut patch = Patch::default();
        // vertices on the cube's edges belong to two or three sides: named by their place on the cube
        let mut by_place: HashMap<[i32; 3], u32> = HashMap::new();
        for axes in CUBE_SIDES {
            let mut indices = Vec::with_capacity((cells + 1).pow(2));
            for (row, column) in (0..=cells).flat_map(|j| (0..=cells).map(move |i| (j, i))) {
                let place = place_on_cube(axes, column, row, cells);
                let index = *by_place.entry(place).or_insert_with(|| {
                    patch.vertices_mm.push(self.surface(lattice, &sphere_direction(place, cells)));
                    patch.vertices_mm.len() as u32 - 1
                });
                indices.push(index);
            }
            patch.add_grid(cells, cells, |i, j| indices[j * (cells + 1) + i]);
        }
        patch
    }
}

/// For each side: the axes along columns, along rows and outward, and the outward sign; right-handed.
const CUBE_SIDES: [([usize; 3], i32); 6] =
    [([0, 1, 2], 1), ([1, 0, 2], -1), ([1, 2, 0], 1), ([2, 1, 0], -1), ([2, 0, 1], 1), ([0, 2, 1], -1)];

fn place_on_cube((axes, sign): ([usize; 3], i32), column: usize, row: usize, cells: usize) -> [i32; 3] {
    let centred = |i: usize| 2 * i as i32 - cells as i32;
    let mut place = [0; 3];
    place[axes[0]] = centred(column);
    place[axes[1]] = centred(row);
    place[axes[2]] = sign * cells as i32;
    place
}

/// Equal angles between neighbours along the cube's middle lines.
fn sphere_direction(place: [i32; 3], cells: usize) -> Vector3<f64> {
    let tangent = |i: i32| (f64::from(i) / cells as f64 * FRAC_PI_4).tan();
    Vector3::from(place.map(tangent)).normalize()
}
