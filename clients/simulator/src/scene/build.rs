//! From recipe to meshed, textured scene.

use nalgebra::{Point3, Vector3};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::{Organ, Overlay, Recipe};
use crate::shape::{Body, Patch};
use crate::texture::{Lattice, Octave, Texture, VesselMap, grow};

/// A vertex of the undeformed scene.
#[derive(Clone, Copy)]
pub(crate) struct Vertex {
    /// In the world.
    pub position_m: Point3<f64>,
    /// Index of its organ.
    pub organ: u16,
    /// How likely the organ's overlying tissue is here, 0 to 1.
    pub overlay: f32,
    /// Share of the surroundings' light that other tissue holds off, 0 to 1.
    pub occlusion: f32,
}

/// A scene at rest.
pub(crate) struct Scene {
    pub lattice: Lattice,
    pub vertices: Vec<Vertex>,
    pub faces: Vec<[u32; 3]>,
    /// By organ.
    pub textures: Vec<Texture>,
    /// By organ.
    pub breathing: Vec<f64>,
    /// Vertices before those of the last body, the wall or bed.
    pub organ_vertices: usize,
    pub pivot_mm: f64,
}

impl Scene {
    pub(super) fn build(lattice: Lattice, recipe: Recipe, coarseness: f64, mut random: Pcg64) -> Self {
        let patches: Vec<Patch> = recipe
            .organs
            .par_iter()
            .map(|organ| organ.body.patch(&lattice, organ.edge_mm * coarseness))
            .collect();
        let mut scene = Self {
            lattice,
            vertices: Vec::new(),
            faces: Vec::new(),
            textures: Vec::new(),
            breathing: Vec::new(),
            organ_vertices: patches.iter().rev().skip(1).map(|patch| patch.vertices_mm.len()).sum(),
            pivot_mm: recipe.pivot_mm,
        };
        for (organ, patch) in recipe.organs.into_iter().zip(&patches) {
            scene.add(organ, patch, &mut random);
        }
        super::occlusion::shade_crevices(&mut scene.vertices, &scene.faces);
        scene
    }

    fn add(&mut self, organ: Organ, patch: &Patch, random: &mut Pcg64) {
        let first = self.vertices.len() as u32;
        let index = self.textures.len() as u16;
        let patches = organ.overlay.as_ref().map(|overlay| Octave::new(overlay.patch_mm, random));
        for point_mm in &patch.vertices_mm {
            let overlay = match (&organ.overlay, &patches) {
                (Some(overlay), Some(octave)) => overlay.at(&organ.body, &self.lattice, octave, point_mm),
                _ => 0.0,
            };
            let position_m = storable(point_mm);
            self.vertices.push(Vertex { position_m, organ: index, overlay, occlusion: 0.0 });
        }
        self.faces.extend(patch.faces.iter().map(|face| face.map(|i| first + i)));
        let segments = organ
            .vessels
            .iter()
            .flat_map(|species| grow(species, &organ.body, &patch.vertices_mm, &self.lattice, random))
            .collect();
        let overlay = organ.overlay.map(|overlay| overlay.material);
        self.textures.push(Texture::new(organ.material, overlay, VesselMap::new(segments), random));
        self.breathing.push(organ.breathing);
    }

    /// Area-weighted normals of the given vertex positions.
    pub fn vertex_normals(&self, positions: &[Point3<f64>]) -> Vec<Vector3<f32>> {
        let mut sums = vec![Vector3::<f64>::zeros(); positions.len()];
        for face in &self.faces {
            let [a, b, c] = face.map(|i| positions[i as usize]);
            let normal = (b - a).cross(&(c - a));
            face.iter().for_each(|&i| sums[i as usize] += normal);
        }
        let unit = |sum: &Vector3<f64>| sum.try_normalize(0.0).unwrap_or(-Vector3::z()).cast();
        sums.iter().map(unit).collect()
    }
}

impl Overlay {
    fn at(&self, body: &Body, lattice: &Lattice, patches: &Octave, point_mm: &Point3<f64>) -> f32 {
        let patch = f64::from(patches.at(lattice, point_mm.coords.cast(), 1e-3).value);
        let furrow = match body {
            Body::Blob(blob) => {
                let in_body = blob.unbent(point_mm);
                self.furrows.iter().map(|f| f.closeness(&in_body)).fold(0.0, f64::max)
            }
            Body::Tube(_) | Body::Sheet(_) => 0.0,
        };
        (0.5 + self.bias + 0.8 * patch + furrow).clamp(0.0, 1.0) as f32
    }
}

/// Metres, rounded to the single precision that the truth file holds, so that truth and pictures agree to the bit.
fn storable(point_mm: &Point3<f64>) -> Point3<f64> {
    point_mm.map(|mm| f64::from((mm * 1e-3) as f32))
}
