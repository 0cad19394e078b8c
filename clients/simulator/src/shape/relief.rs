//! Irregular displacement that turns a smooth shape into an organ.

use nalgebra::Point3;
use rand_pcg::Pcg64;

use crate::texture::{Lattice, Octave};

/// A sum of noise octaves, each with its own height.
pub(crate) struct Relief {
    octaves: Vec<(Octave, f64)>,
}

impl Relief {
    /// Pairs of feature size and height, both in millimetres.
    pub fn new(size_and_height_mm: &[(f32, f64)], random: &mut Pcg64) -> Self {
        let octave = |&(size_mm, height_mm)| (Octave::new(size_mm, random), height_mm);
        Self { octaves: size_and_height_mm.iter().map(octave).collect() }
    }

    /// Displacement along the outward direction, millimetres.
    pub fn height_mm(&self, lattice: &Lattice, point_mm: &Point3<f64>) -> f64 {
        const FULLY_SHOWN_MM: f32 = 1e-3;
        let point = point_mm.coords.cast::<f32>();
        let octave_height = |(octave, height_mm): &(Octave, f64)| {
            f64::from(octave.at(lattice, point, FULLY_SHOWN_MM).value) * height_mm
        };
        self.octaves.iter().map(octave_height).sum()
    }
}
