//! Recipes of the scenes: which organs, where, of which tissue.

mod abdomen;
mod build;
mod heart;
mod kidney;
mod liver;
mod occlusion;
mod phantom;
mod tissue;

pub(crate) use build::{Scene, Vertex};

use nalgebra::{Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::SceneKind;
use crate::shape::{Body, Furrow, Swelling};
use crate::texture::{Lattice, Material, VesselSpecies};

/// Where a second tissue lies over the first.
pub(crate) struct Overlay {
    pub material: Material,
    /// Along these furrows of a blob.
    pub furrows: Vec<Furrow>,
    /// In patches of this size, millimetres.
    pub patch_mm: f32,
    /// Added everywhere: 0 for as much as not, negative for less.
    pub bias: f64,
}

/// One organ before it is meshed.
pub(crate) struct Organ {
    pub body: Body,
    pub material: Material,
    pub overlay: Option<Overlay>,
    pub vessels: Vec<VesselSpecies>,
    /// Share of the breathing that it follows.
    pub breathing: f64,
    /// Edge length of its triangles.
    pub edge_mm: f64,
}

/// A recipe: the organs first, the wall or bed behind them last.
pub(crate) struct Recipe {
    pub organs: Vec<Organ>,
    /// Depth of the point that the scope circles around.
    pub pivot_mm: f64,
}

/// What recipes draw from.
pub(crate) struct Kitchen {
    pub random: Pcg64,
}

impl Scene {
    /// The scene of a kind; the seed varies its shape, texture and vessels.
    ///
    /// `coarseness` scales the triangles: small pictures need no fine mesh.
    pub fn of_kind(kind: SceneKind, seed: u64, coarseness: f64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let lattice = Lattice::new(&mut random);
        let mut kitchen = Kitchen { random };
        let recipe = match kind {
            SceneKind::Heart => heart::recipe(&mut kitchen),
            SceneKind::Liver => liver::recipe(&mut kitchen),
            SceneKind::Kidney => kidney::recipe(&mut kitchen),
            SceneKind::Phantom => phantom::recipe(&mut kitchen),
            SceneKind::Abdomen => abdomen::recipe(&mut kitchen),
        };
        let random = kitchen.random;
        Self::build(lattice, recipe, coarseness, random)
    }
}

impl Kitchen {
    /// A value varied by up to a share of itself.
    pub fn about(&mut self, value: f64, share: f64) -> f64 {
        value * (1.0 + self.random.random_range(-share..share))
    }

    /// A rotation by Euler angles in degrees, each varied by up to `spread_deg`.
    pub fn turned(&mut self, roll_pitch_yaw_deg: [f64; 3], spread_deg: f64) -> Rotation3<f64> {
        let [roll, pitch, yaw] = roll_pitch_yaw_deg
            .map(|deg| (deg + self.random.random_range(-spread_deg..spread_deg)).to_radians());
        Rotation3::from_euler_angles(roll, pitch, yaw)
    }

    /// Soft swellings and hollows all around.
    pub fn lobes(&mut self, count: usize, height: f64) -> Vec<Swelling> {
        let mut lobe = |_| Swelling {
            direction: Vector3::from_fn(|_, _| self.random.random_range(-1.0..1.0)),
            height: self.random.random_range(-0.6..1.0) * height,
            width_rad: self.random.random_range(0.3..0.7),
        };
        (0..count).map(&mut lobe).collect()
    }
}
