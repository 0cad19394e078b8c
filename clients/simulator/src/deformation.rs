//! How the tissue moves: a closed form of the time, so that truth is exact at any instant.
//!
//! `x(t) = x0 + gain(x0) v (1 - cos 2 pi f t) / 2 + sum_k S((t - t_k) / d_k) psi(|x0 - c_k| / r_k) u_k`
//! with `x0` the shape at the first frame, breathing (or a beat) of direction `v`, and pushes `k`, each moving a
//! vertex `c_k` by `u_k` with smooth fall-off (paper, validation using simulation: 2-3 mm at a random vertex).

use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use crate::scene::Vertex;

/// One push of the tissue; it stays where it was pushed to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Vertex of the undeformed shape that moves most, in the world.
    pub centre_m: Point3<f64>,
    /// Its displacement.
    pub displacement_m: Vector3<f64>,
    /// Where the displacement has faded to nothing.
    pub radius_m: f64,
    /// Seconds after the first frame.
    pub start_s: f64,
    /// How long it takes.
    pub duration_s: f64,
}

/// The whole motion of a scene.
pub(crate) struct Deformation {
    /// By vertex.
    pub gain: Vec<f32>,
    pub swing_m: Vector3<f64>,
    pub swing_hz: f64,
    pub pushes: Vec<Push>,
    /// By push: vertices that it moves and their share.
    shares: Vec<Vec<(u32, f64)>>,
}

/// Wendland's C2 function with compact support, `(1 - r)^4 (4 r + 1)` below 1.
fn wendland_c2(r: f64) -> f64 {
    let r = r.clamp(0.0, 1.0);
    (1.0 - r).powi(4) * (4.0 * r + 1.0)
}

/// From 0 to 1 over the unit interval with two continuous derivatives.
pub(crate) fn smoother(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (x * (6.0 * x - 15.0) + 10.0)
}

impl Deformation {
    /// Only the periodic term, of amplitude `swing_m` times each vertex's gain.
    pub fn periodic(gain: Vec<f32>, swing_m: Vector3<f64>, swing_hz: f64) -> Self {
        Self { gain, swing_m, swing_hz, pushes: Vec::new(), shares: Vec::new() }
    }

    /// Adds a push.
    pub fn push(&mut self, rest: &[Vertex], push: Push) {
        let share = |vertex: &Vertex| (vertex.position_m - push.centre_m).norm() / push.radius_m;
        let near = rest.iter().enumerate().filter_map(|(i, vertex)| {
            let r = share(vertex);
            (r < 1.0).then(|| (i as u32, wendland_c2(r)))
        });
        self.shares.push(near.collect());
        self.pushes.push(push);
    }

    /// Displacement of a vertex by the pushes alone, breathing left out.
    pub fn pushed_m(&self, vertex: u32, time_s: f64) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for (push, shares) in self.pushes.iter().zip(&self.shares) {
            if let Ok(place) = shares.binary_search_by_key(&vertex, |&(i, _)| i) {
                sum += push.displacement_m * (push.progress(time_s) * shares[place].1);
            }
        }
        sum
    }

    /// All vertices at a time, in the world.
    pub fn at(&self, rest: &[Vertex], time_s: f64) -> Vec<Point3<f64>> {
        let swing = 0.5 * (1.0 - (TAU * self.swing_hz * time_s).cos());
        let swung =
            |(vertex, gain): (&Vertex, &f32)| vertex.position_m + self.swing_m * (f64::from(*gain) * swing);
        let mut positions: Vec<Point3<f64>> = rest.iter().zip(&self.gain).map(swung).collect();
        for (push, shares) in self.pushes.iter().zip(&self.shares) {
            let displacement_m = push.displacement_m * push.progress(time_s);
            if displacement_m != Vector3::zeros() {
                shares.iter().for_each(|&(i, share)| positions[i as usize] += displacement_m * share);
            }
        }
        positions
    }
}

impl Push {
    fn progress(&self, time_s: f64) -> f64 {
        smoother((time_s - self.start_s) / self.duration_s)
    }
}
