//! Positive definite systems, solved by faer.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Solves `matrix * x = right_side`, reading the lower triangle; `None` where the matrix is not positive definite or the
/// solution not finite.
pub(super) fn solve_dense(matrix: &Mat<f64>, right_side: &[f64]) -> Option<Vec<f64>> {
    let factor = matrix.llt(Side::Lower).ok()?;
    finite(&factor.solve(column(right_side)))
}

fn column(values: &[f64]) -> Mat<f64> {
    Mat::from_fn(values.len(), 1, |row, _| values[row])
}

fn finite(column: &Mat<f64>) -> Option<Vec<f64>> {
    let values: Vec<f64> = (0..column.nrows()).map(|row| column[(row, 0)]).collect();
    values.iter().all(|value| value.is_finite()).then_some(values)
}
