//! Rotations printed as matrices.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Largest departure from a rotation that printing makes; seven digits give 1e-7.
const ORTHONORMAL_TOLERANCE: f64 = 1e-4;

/// The rotation of a 3x3 matrix, row by row, its printed digits made a rotation again; `None` where it is none.
pub(crate) fn rotation_from_rows(rows: &[f64; 9]) -> Option<UnitQuaternion<f64>> {
    let matrix = Matrix3::from_row_slice(rows);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    // Written so that a NaN is refused too.
    let is_rotation = off <= ORTHONORMAL_TOLERANCE && matrix.determinant() > 0.0;
    is_rotation.then(|| {
        let nearly_unit = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        UnitQuaternion::new_normalize(nearly_unit.into_inner())
    })
}

/// The rigid motion of the first three rows, row by row, of a 4x4 matrix; `None` where it is none.
pub(crate) fn pose_from_rows(m: &[f64; 12]) -> Option<geometry::Pose> {
    let &[r00, r01, r02, x, r10, r11, r12, y, r20, r21, r22, z] = m;
    let rotation = rotation_from_rows(&[r00, r01, r02, r10, r11, r12, r20, r21, r22])?;
    let is_finite = [x, y, z].iter().all(|value| value.is_finite());
    is_finite.then(|| geometry::Pose::from_parts(nalgebra::Translation3::new(x, y, z), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_half_turn_printed_with_seven_digits_is_a_rotation() {
        let half_turn = [-0.9999999, 0.0, 0.0004, 0.0, 1.0, 0.0, -0.0004, 0.0, -0.9999999];
        let rotation = rotation_from_rows(&half_turn).unwrap();
        assert!((rotation.angle() - std::f64::consts::PI).abs() < 1e-3);
        assert!((rotation.norm() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn mirrors_scalings_and_nan_are_no_rotations() {
        for diagonal in [[1.0, 1.0, -1.0], [1.1, 1.0, 1.0], [f64::NAN, 1.0, 1.0], [0.0; 3]] {
            let [a, b, c] = diagonal;
            assert_eq!(rotation_from_rows(&[a, 0.0, 0.0, 0.0, b, 0.0, 0.0, 0.0, c]), None);
        }
    }
}
