//! The step of a bundle: points are eliminated, the reduced camera system is solved, points follow.
//!
//! With `H_pp` block diagonal, `S = H_cc - W H_pp^-1 W'` and `S xi = -(g_c - W H_pp^-1 g_p)`, a dense 6n x 6n system for n free
//! cameras (faer's Cholesky); then `d_j = -H_pp,j^-1 (g_p,j + W_j' xi)`. Damping multiplies the diagonals by
//! `1 + lambda` (Marquardt).

use faer::Mat;
use nalgebra::{Matrix3, Matrix6x3, Vector3, Vector6};

use super::Bundle;
use super::linearise::{NormalEquations, PointBlock};
use crate::optimize::cholesky::solve_dense;

/// Where to move.
pub(super) struct Step {
    /// Tangent of each camera; `None` for fixed ones.
    pub cameras: Vec<Option<Vector6<f64>>>,
    /// Offset of each point.
    pub points: Vec<Vector3<f64>>,
}

/// The damped step; `None` where the cameras are not determined.
pub(super) fn solve(bundle: &Bundle, equations: &NormalEquations, damping: f64) -> Option<Step> {
    let inverses: Vec<Option<Matrix3<f64>>> =
        equations.points.iter().map(|block| inverse_damped(&block.hessian, damping)).collect();
    let tangents = if equations.cameras.is_empty() {
        Vec::new()
    } else {
        let (matrix, right_side) = reduced_system(equations, &inverses, damping);
        solve_dense(&matrix, &right_side)?
    };
    let tangent_of = |place: usize| Vector6::from_column_slice(&tangents[6 * place..6 * place + 6]);
    let offset = |(block, inverse): (&PointBlock, &Option<Matrix3<f64>>)| {
        let Some(inverse) = inverse else { return Vector3::zeros() };
        let pulled = block
            .coupling
            .iter()
            .fold(block.gradient, |sum, (place, coupling)| sum + coupling.tr_mul(&tangent_of(*place)));
        -(inverse * pulled)
    };
    let points: Vec<Vector3<f64>> = equations.points.iter().zip(&inverses).map(offset).collect();
    let finite = points.iter().all(|offset| offset.iter().all(|value| value.is_finite()));
    let cameras = equations.free.iter().map(|place| place.map(tangent_of)).collect();
    debug_assert_eq!(points.len(), bundle.points.len());
    finite.then_some(Step { cameras, points })
}

/// `None` for points that their sightings do not determine: they stay where they are and tie no cameras.
fn inverse_damped(hessian: &Matrix3<f64>, damping: f64) -> Option<Matrix3<f64>> {
    let mut damped = *hessian;
    for axis in 0..3 {
        damped[(axis, axis)] *= 1.0 + damping;
    }
    Some(damped.cholesky()?.inverse())
}

/// `S` (lower triangle) and the right side.
fn reduced_system(
    equations: &NormalEquations,
    inverses: &[Option<Matrix3<f64>>],
    damping: f64,
) -> (Mat<f64>, Vec<f64>) {
    let size = 6 * equations.cameras.len();
    let mut matrix = Mat::zeros(size, size);
    let mut right_side = vec![0.0; size];
    for (place, (hessian, gradient)) in equations.cameras.iter().enumerate() {
        for row in 0..6 {
            right_side[6 * place + row] = -gradient[row];
            for column in 0..=row {
                matrix[(6 * place + row, 6 * place + column)] = hessian[(row, column)];
            }
            matrix[(6 * place + row, 6 * place + row)] +=
                damping * hessian[(row, row)].max(f64::MIN_POSITIVE);
        }
    }
    for (block, inverse) in equations.points.iter().zip(inverses) {
        if let Some(inverse) = inverse {
            eliminate(block, inverse, &mut matrix, &mut right_side);
        }
    }
    (matrix, right_side)
}

fn eliminate(block: &PointBlock, inverse: &Matrix3<f64>, matrix: &mut Mat<f64>, right_side: &mut [f64]) {
    for (row_place, row_coupling) in &block.coupling {
        let weighted: Matrix6x3<f64> = row_coupling * inverse;
        let slope = weighted * block.gradient;
        for row in 0..6 {
            right_side[6 * row_place + row] += slope[row];
        }
        for (column_place, column_coupling) in &block.coupling {
            if column_place > row_place {
                continue;
            }
            let product = weighted * column_coupling.transpose();
            for column in 0..6 {
                for row in 0..6 {
                    matrix[(6 * row_place + row, 6 * column_place + column)] -= product[(row, column)];
                }
            }
        }
    }
}
