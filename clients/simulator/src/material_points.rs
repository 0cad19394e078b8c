//! Material points whose way through the run is known.

use nalgebra::Point3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::scene::Scene;
use crate::{SceneConfig, SimulatorError};

/// A place of the material, fixed in a face.
pub(crate) struct MaterialPoint {
    pub face: u32,
    pub barycentric: [f64; 3],
}

/// Points spread evenly over the faces whose corners were all seen.
///
/// # Errors
/// [`SimulatorError::NothingInView`] if no face was.
pub(crate) fn spread(
    config: &SceneConfig,
    scene: &Scene,
    seen: &[u16],
) -> Result<Vec<MaterialPoint>, SimulatorError> {
    let mut random = Pcg64::seed_from_u64(config.seed ^ 0x0009_0195);
    let mut area_up_to = Vec::with_capacity(scene.faces.len());
    let mut total = 0.0;
    for face in &scene.faces {
        if face.iter().all(|&i| seen[i as usize] > 0) {
            let [a, b, c] = face.map(|i| scene.vertices[i as usize].position_m);
            total += (b - a).cross(&(c - a)).norm();
        }
        area_up_to.push(total);
    }
    if total <= 0.0 {
        return Err(SimulatorError::NothingInView);
    }
    let draw = |_| {
        let area = random.random_range(0.0..total);
        let face = area_up_to.partition_point(|&up_to| up_to <= area) as u32;
        // uniform over the triangle by folding the unit square
        let (u, v): (f64, f64) = (random.random_range(0.0..1.0), random.random_range(0.0..1.0));
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        MaterialPoint { face, barycentric: [1.0 - u - v, u, v] }
    };
    Ok((0..config.points).map(draw).collect())
}

impl MaterialPoint {
    /// Where the point is when the vertices are at `positions`.
    pub fn at(&self, faces: &[[u32; 3]], positions: &[Point3<f64>]) -> Point3<f64> {
        let corners = faces[self.face as usize].map(|i| positions[i as usize].coords);
        let [a, b, c] = self.barycentric;
        Point3::from(corners[0] * a + corners[1] * b + corners[2] * c)
    }
}
