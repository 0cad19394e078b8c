//! Closed-form organ surfaces, in millimetres in the world (first left camera), and their meshes.

mod blob;
mod relief;
mod sheet;
mod tube;

pub(crate) use blob::{Blob, Furrow, Swelling};
pub(crate) use relief::Relief;
pub(crate) use sheet::Sheet;
pub(crate) use tube::Tube;

use nalgebra::{Point3, Vector3};

use crate::texture::Lattice;

/// Faces that look away from the scope by more than this (z of the outward normal) are left out:
/// no view of a run comes round that far.
const AWAY: f64 = 0.5;

/// One continuous surface.
pub(crate) enum Body {
    /// A closed organ.
    Blob(Blob),
    /// Gut.
    Tube(Tube),
    /// The wall or bed behind the organs.
    Sheet(Sheet),
}

/// Triangles of one body, outward side counter-clockwise.
#[derive(Default)]
pub(crate) struct Patch {
    pub vertices_mm: Vec<Point3<f64>>,
    pub faces: Vec<[u32; 3]>,
}

impl Body {
    /// The point of the surface nearest to a point that is close to it (nearest along the body's own rays).
    pub fn project(&self, lattice: &Lattice, point_mm: &Point3<f64>) -> Point3<f64> {
        match self {
            Self::Blob(blob) => blob.project(lattice, point_mm),
            Self::Tube(tube) => tube.project(lattice, point_mm),
            Self::Sheet(sheet) => sheet.project(lattice, point_mm),
        }
    }

    /// The outward normal at a point of the surface.
    pub fn normal(&self, lattice: &Lattice, point_mm: &Point3<f64>) -> Vector3<f64> {
        const STEP_MM: f64 = 0.5;
        let outward = self.outward(point_mm);
        let tangent = outward.cross(&least_aligned_axis(&outward)).normalize();
        let bitangent = outward.cross(&tangent);
        let here = self.project(lattice, point_mm);
        let along = self.project(lattice, &(point_mm + tangent * STEP_MM)) - here;
        let across = self.project(lattice, &(point_mm + bitangent * STEP_MM)) - here;
        let normal = along.cross(&across);
        let length = normal.norm();
        if length > 1e-9 { normal / length } else { outward }
    }

    /// Roughly outward: the direction of the ray that [`Body::project`] follows.
    fn outward(&self, point_mm: &Point3<f64>) -> Vector3<f64> {
        match self {
            Self::Blob(blob) => blob.outward(point_mm),
            Self::Tube(tube) => tube.outward(point_mm),
            Self::Sheet(_) => -Vector3::z(),
        }
    }

    /// Triangles with edges of about `edge_mm`.
    pub fn patch(&self, lattice: &Lattice, edge_mm: f64) -> Patch {
        let whole = match self {
            Self::Blob(blob) => blob.patch(lattice, edge_mm),
            Self::Tube(tube) => tube.patch(lattice, edge_mm),
            Self::Sheet(sheet) => sheet.patch(lattice, edge_mm),
        };
        whole.without_far_side()
    }
}

impl Patch {
    /// Splits each cell of a grid of vertex indices into two triangles.
    fn add_grid(&mut self, columns: usize, rows: usize, index: impl Fn(usize, usize) -> u32) {
        for j in 0..rows {
            for i in 0..columns {
                let [a, b] = [index(i, j), index(i + 1, j)];
                let [c, d] = [index(i, j + 1), index(i + 1, j + 1)];
                // alternating diagonals, so that the facets have no common direction
                let pair = if (i + j) % 2 == 0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
                self.faces.extend(pair);
            }
        }
    }

    fn face_normal(&self, face: &[u32; 3]) -> Vector3<f64> {
        let [a, b, c] = face.map(|i| self.vertices_mm[i as usize]);
        (b - a).cross(&(c - a))
    }

    fn without_far_side(self) -> Self {
        let towards = |face: &[u32; 3]| {
            let normal = self.face_normal(face);
            normal.norm() > 1e-9 && normal.z <= AWAY * normal.norm()
        };
        let mut new_index = vec![u32::MAX; self.vertices_mm.len()];
        let mut kept = Self::default();
        for face in self.faces.iter().filter(|face| towards(face)) {
            let renamed = face.map(|old| {
                let slot = &mut new_index[old as usize];
                if *slot == u32::MAX {
                    *slot = kept.vertices_mm.len() as u32;
                    kept.vertices_mm.push(self.vertices_mm[old as usize]);
                }
                *slot
            });
            kept.faces.push(renamed);
        }
        kept
    }
}

fn least_aligned_axis(direction: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[direction.iamin()] = 1.0;
    axis
}
