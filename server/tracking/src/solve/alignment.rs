//! The rigid motion between two sets of corresponding points, in closed form (Kabsch 1976; Umeyama 1991).

use geometry::Pose;
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// Second singular value of the scatter over the first, below which the points lie on a line.
const COLLINEAR_RATIO: f64 = 1e-6;

/// `target_from_source` with least squared distances; `None` for fewer than three points or points on a line.
pub fn align(source: &[Point3<f64>], target: &[Point3<f64>]) -> Option<Pose> {
    if source.len() < 3 || source.len() != target.len() {
        return None;
    }
    let mean = |points: &[Point3<f64>]| {
        points.iter().fold(Vector3::zeros(), |sum, point| sum + point.coords) / points.len() as f64
    };
    let (source_mean, target_mean) = (mean(source), mean(target));
    let mut scatter = Matrix3::zeros();
    for (a, b) in source.iter().zip(target) {
        scatter += (b.coords - target_mean) * (a.coords - source_mean).transpose();
    }
    let svd = scatter.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let spread = svd.singular_values;
    if spread[1].is_nan() || spread[1] <= COLLINEAR_RATIO * spread[0] {
        return None;
    }
    let handedness = (u * v_t).determinant().signum();
    let matrix = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handedness)) * v_t;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    Some(Pose::from_parts(Translation3::from(target_mean - rotation * source_mean), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::se3;
    use nalgebra::Vector6;

    #[test]
    fn the_motion_of_three_points_is_exact() {
        let source = [Point3::new(0.1, 0.0, 0.3), Point3::new(-0.2, 0.1, 0.2), Point3::new(0.0, -0.1, 0.4)];
        let truth = se3::exp(&Vector6::new(0.1, -0.2, 0.3, 1.0, -2.0, 0.5));
        let target = source.map(|point| truth * point);
        let found = align(&source, &target).expect("not on a line");
        assert!(se3::log(&(found * truth.inverse())).norm() < 1e-9);
    }

    #[test]
    fn points_on_a_line_are_refused() {
        let source = [0.0, 1.0, 2.0].map(|t| Point3::new(t, 2.0 * t, 1.0 - t));
        assert_eq!(align(&source, &source), None);
        assert_eq!(align(&source[..2], &source[..2]), None);
    }
}
