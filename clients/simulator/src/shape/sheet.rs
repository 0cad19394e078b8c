//! The wall or bed behind the organs: a relief over a plane across the view.

use nalgebra::Point3;

use super::{Patch, Relief};
use crate::texture::Lattice;

/// A height field over x and y, facing the scope.
pub(crate) struct Sheet {
    /// Depth in the middle.
    pub depth_mm: f64,
    /// Reaches from minus to plus this in x and y.
    pub half_size_mm: f64,
    /// Slope of the depth along x and y.
    pub slope: [f64; 2],
    /// How much nearer the border is than the middle: a cavity.
    pub cupping_mm: f64,
    pub relief: Relief,
}

impl Sheet {
    fn at(&self, lattice: &Lattice, x: f64, y: f64) -> Point3<f64> {
        let cup = self.cupping_mm * (x * x + y * y) / self.half_size_mm.powi(2);
        let smooth = Point3::new(x, y, self.depth_mm + self.slope[0] * x + self.slope[1] * y - cup);
        Point3::new(x, y, smooth.z - self.relief.height_mm(lattice, &smooth))
    }

    pub(super) fn project(&self, lattice: &Lattice, point_mm: &Point3<f64>) -> Point3<f64> {
        self.at(lattice, point_mm.x, point_mm.y)
    }

    pub(super) fn patch(&self, lattice: &Lattice, edge_mm: f64) -> Patch {
        let cells = (2.0 * self.half_size_mm / edge_mm).ceil() as usize;
        let place = |i: usize| self.half_size_mm * (2.0 * i as f64 / cells as f64 - 1.0);
        let mut patch = Patch::default();
        for (row, column) in (0..=cells).flat_map(|j| (0..=cells).map(move |i| (j, i))) {
            patch.vertices_mm.push(self.at(lattice, place(column), place(row)));
        }
        // rows first: the outward side looks towards minus z
        patch.add_grid(cells, cells, |i, j| (i * (cells + 1) + j) as u32);
        patch
    }
}
