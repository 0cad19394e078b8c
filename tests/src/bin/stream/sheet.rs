//! A sheet of tissue that never rests: it beats, breathes, is sheared, and a wave runs through it.
//!
//! No two of its points move alike, and no set of nodes moves it exactly. Surfels also tremble by the noise that fusion
//! leaves, anew in each frame.

use std::f64::consts::TAU;

use dense::Surfel;
use dense::synthetic::MovedNode;
use nalgebra::{Matrix3, Vector3};

const SURFEL_SPACING_M: f64 = 4e-4;
const NODE_SPACING_M: f64 = 4e-3;
/// Largest noise of a surfel along each axis.
const NOISE_M: f64 = 3e-5;
/// Distance over which slopes are taken.
const STEP_M: f64 = 1e-5;

/// A square sheet.
pub struct Sheet {
    surfels: u32,
    side: u32,
    node_side: u32,
}

impl Sheet {
    /// Of so many surfels.
    pub fn new(surfels: u32) -> Self {
        let side = f64::from(surfels).sqrt().ceil() as u32;
        let node_side = (f64::from(side) * SURFEL_SPACING_M / NODE_SPACING_M).ceil() as u32 + 1;
        Self { surfels, side, node_side }
    }

    /// Nodes that it has.
    pub fn nodes(&self) -> usize {
        (self.node_side * self.node_side) as usize
    }

    /// All surfels at a time.
    pub fn surfels_at(&self, time_s: f64, frame: u32) -> Vec<Surfel> {
        (0..self.surfels).map(|id| self.surfel(id, time_s, frame)).collect()
    }

    /// One surfel at a time; `frame` chooses its noise.
    pub fn surfel(&self, id: u32, time_s: f64, frame: u32) -> Surfel {
        let (u, v) = grid(id, self.side, SURFEL_SPACING_M);
        let noise = Vector3::from([0, 1, 2].map(|axis| NOISE_M * noise(id, 3 * frame + axis)));
        let frame = frame_of(u, v, time_s);
        Surfel {
            id,
            position: (point(u, v, time_s) + noise).map(|x| x as f32).into(),
            normal: (-frame.column(2)).map(|x| x as f32).into(),
            radius_m: 3e-4,
            weight: 15.0,
            color: [200, (90.0 + 40.0 * (300.0 * u).sin()) as u8, (70.0 + 30.0 * (500.0 * v).cos()) as u8],
            stamp: 0,
        }
    }

    /// All nodes at `now_s`, and what they did since `before_s`.
    pub fn nodes_at(&self, before_s: f64, now_s: f64) -> Vec<MovedNode> {
        let node = |id| {
            let (u, v) = grid(id, self.node_side, NODE_SPACING_M);
            let before = frame_of(u, v, before_s);
            let undone = before.try_inverse().unwrap_or_else(Matrix3::identity);
            let affine = frame_of(u, v, now_s) * undone;
            MovedNode {
                position: point(u, v, now_s).map(|x| x as f32).into(),
                affine: [0, 1, 2].map(|row| affine.row(row).transpose().map(|x| x as f32).into()),
            }
        };
        (0..self.nodes() as u32).map(node).collect()
    }
}

/// Place on the sheet at rest of the element `id` of a square grid around its middle.
fn grid(id: u32, side: u32, spacing_m: f64) -> (f64, f64) {
    let along = |place: u32| (f64::from(place) - f64::from(side - 1) / 2.0) * spacing_m;
    (along(id % side), along(id / side))
}

/// Where a material point is at a time, world, metres.
fn point(u: f64, v: f64, time_s: f64) -> Vector3<f64> {
    let beat = (TAU * 1.2 * time_s).sin().max(0.0).powi(2) * (-(u * u + v * v) / 9e-4).exp();
    let breath = (TAU * 0.25 * time_s).sin();
    let wave = (TAU * (u / 0.03 - time_s)).sin();
    let shear = (TAU * (v / 0.05 + 0.7 * time_s)).sin();
    Vector3::new(
        u + 0.0015 * shear,
        v + 0.006 * breath,
        0.1 + 4.0 * (u * u + v * v) - 0.004 * beat + 0.003 * breath + 0.001 * wave,
    )
}

/// The two tangents and the normal at a material point.
fn frame_of(u: f64, v: f64, time_s: f64) -> Matrix3<f64> {
    let here = point(u, v, time_s);
    let along_u = (point(u + STEP_M, v, time_s) - here) / STEP_M;
    let along_v = (point(u, v + STEP_M, time_s) - here) / STEP_M;
    Matrix3::from_columns(&[along_u, along_v, along_u.cross(&along_v).normalize()])
}

/// A number in -1..1 that looks random.
fn noise(id: u32, salt: u32) -> f64 {
    let hash = protocol::surfel_digest(id.wrapping_add(1), salt.wrapping_add(1));
    f64::from(hash) / f64::from(u32::MAX) * 2.0 - 1.0
}
