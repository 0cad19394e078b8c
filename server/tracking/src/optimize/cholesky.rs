//! Positive definite systems, solved by faer.

use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
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

/// The same with a sparse matrix of which the entries on and below the diagonal are given; those of one place add up.
pub(super) fn solve_sparse(lower: &[Triplet<usize, usize, f64>], right_side: &[f64]) -> Option<Vec<f64>> {
    let size = right_side.len();
    let matrix = SparseColMat::<usize, f64>::try_new_from_triplets(size, size, lower).ok()?;
    let factor = matrix.sp_cholesky(Side::Lower).ok()?;
    finite(&factor.solve(column(right_side)))
}
