//! Least squares over many unknowns at once: bundle adjustment and pose graphs.

pub mod bundle;
mod cholesky;
pub mod pose_graph;
