//! Darkening of crevices: how much of each vertex's surroundings other tissue covers.
//!
//! Surface discs as occluders (Bunnell, GPU Gems 2, chapter 14), from a thinned set of vertices within reach.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::Vertex;

const REACH_MM: f64 = 12.0;
/// Every so many-th vertex stands for the area of as many.
const THINNING: usize = 9;

struct Disc {
    centre_mm: Point3<f64>,
    normal: Vector3<f64>,
    area_mm2: f64,
}

/// Discs by cubic cell of the reach's size.
type DiscGrid = HashMap<[i32; 3], Vec<Disc>>;

/// Fills in [`Vertex::occlusion`].
pub(super) fn shade_crevices(vertices: &mut [Vertex], faces: &[[u32; 3]]) {
    let (normals, areas) = normals_and_areas(vertices, faces);
    let mut grid = DiscGrid::new();
    for i in (0..vertices.len()).step_by(THINNING) {
        let centre_mm = vertices[i].position_m * 1e3;
        let disc = Disc { centre_mm, normal: normals[i], area_mm2: areas[i] * THINNING as f64 };
        grid.entry(cell(&centre_mm)).or_default().push(disc);
    }
    vertices.par_iter_mut().zip(&normals).for_each(|(vertex, normal)| {
        vertex.occlusion = occlusion(&grid, &(vertex.position_m * 1e3), normal) as f32;
    });
}

fn normals_and_areas(vertices: &[Vertex], faces: &[[u32; 3]]) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let mut normals = vec![Vector3::zeros(); vertices.len()];
    let mut areas = vec![0.0; vertices.len()];
    for face in faces {
        let [a, b, c] = face.map(|i| vertices[i as usize].position_m * 1e3);
        let twice_area = (b - a).cross(&(c - a));
        for &i in face {
            normals[i as usize] += twice_area;
            areas[i as usize] += twice_area.norm() / 6.0;
        }
    }
    normals.iter_mut().for_each(|n| *n = n.try_normalize(0.0).unwrap_or(-Vector3::z()));
    (normals, areas)
}

fn cell(point_mm: &Point3<f64>) -> [i32; 3] {
    [0, 1, 2].map(|axis| (point_mm[axis] / REACH_MM).floor() as i32)
}

fn occlusion(grid: &DiscGrid, point_mm: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
    let [x, y, z] = cell(point_mm);
    let around =
        (-1..=1).flat_map(|k| (-1..=1).flat_map(move |j| (-1..=1).map(move |i| [x + i, y + j, z + k])));
    let discs = around.filter_map(|key| grid.get(&key)).flatten();
    let covered: f64 = discs.map(|disc| disc.covers(point_mm, normal)).sum();
    1.0 - (-1.6 * covered).exp()
}

impl Disc {
    /// Share of the point's hemisphere that the disc takes.
    fn covers(&self, point_mm: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let towards = self.centre_mm - point_mm;
        let distance = towards.norm();
        if !(0.8..REACH_MM).contains(&distance) {
            return 0.0;
        }
        let fade = 1.0 - (distance / REACH_MM).powi(2);
        // a surface seen from behind covers just as well: organs press into each other
        let facing = self.normal.dot(&towards).abs() / distance;
        let above = (normal.dot(&towards) / distance - 0.08).max(0.0);
        above * facing * fade * self.area_mm2 / (std::f64::consts::PI * distance * distance + self.area_mm2)
    }
}
