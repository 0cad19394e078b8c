//! The similarity that best carries one set of points to another (Umeyama 1991).

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

/// Variance (m^2) below which points have no extent and so no scale.
const LEAST_VARIANCE_M2: f64 = 1e-18;

/// Whether [`umeyama`] may scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Rigid: scale is 1, as for stereo.
    One,
    /// The scale that fits best.
    Free,
}

/// `point -> scale * rotation * point + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Turns.
    pub rotation: Rotation3<f64>,
    /// Moves, in metres.
    pub translation: Vector3<f64>,
    /// Stretches.
    pub scale: f64,
}

impl Similarity {
    /// The image of a point.
    pub fn transform(&self, point: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * point.coords * self.scale + self.translation)
    }
}

/// The similarity with the least sum of squared distances `|target - similarity(source)|`.
///
/// `None` for sets that are empty, of different length or not finite.
pub fn umeyama(source: &[Point3<f64>], target: &[Point3<f64>], scale: Scale) -> Option<Similarity> {
    if source.is_empty() || source.len() != target.len() {
        return None;
    }
    let count = source.len() as f64;
    let (source_mean, target_mean) = (mean(source), mean(target));
    let mut covariance = Matrix3::zeros();
    let mut source_variance = 0.0;
    for (s, t) in source.iter().zip(target) {
        let (s, t) = (s.coords - source_mean, t.coords - target_mean);
        covariance += t * s.transpose() / count;
        source_variance += s.norm_squared() / count;
    }
    if !covariance.iter().all(|value| value.is_finite()) {
        return None;
    }
    let (rotation, trace) = best_rotation(&covariance)?;
    let scale = match scale {
        Scale::Free if source_variance > LEAST_VARIANCE_M2 => trace / source_variance,
        _ => 1.0,
    };
    let translation = target_mean - rotation * source_mean * scale;
    Some(Similarity { rotation, translation, scale })
}

/// The rotation `R` that maximises `trace(R^T covariance)`, and that trace.
fn best_rotation(covariance: &Matrix3<f64>) -> Option<(Rotation3<f64>, f64)> {
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut signs = Vector3::repeat(1.0);
    if u.determinant() * v_t.determinant() < 0.0 {
        signs[svd.singular_values.imin()] = -1.0;
    }
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    Some((Rotation3::from_matrix_unchecked(rotation), svd.singular_values.dot(&signs)))
}

fn mean(points: &[Point3<f64>]) -> Vector3<f64> {
    points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len() as f64
}
