//! Efficient large-scale stereo matching (Geiger, Roser, Urtasun: ACCV 2010), in the frame's own encoder.
//!
//! Support points that match beyond doubt are triangulated; their planes are the prior of every pixel, beside the
//! disparities found near it. Everything is done on the GPU but the triangulation: for it the support points are read
//! back in the middle of the frame, while the GPU goes on with the part of the matching that needs no prior.

/// A kernel file of this folder, with what it shares with the others.
macro_rules! elas_text {
    ($file:literal) => {
        concat!(
            include_str!($file),
            include_str!("search.wgsl"),
            include_str!("views.wgsl"),
            include_str!("../common.wgsl")
        )
    };
}

mod adaptive_mean;
mod buffers;
#[cfg(test)]
mod candidates_oracle;
mod check_views;
#[cfg(test)]
mod check_views_oracle;
mod close_gaps;
mod config;
mod describe;
#[cfg(test)]
mod describe_oracle;
mod drop_implausible;
mod drop_redundant;
mod fill_triangles;
#[cfg(test)]
mod fill_triangles_oracle;
mod filters;
mod mark_candidates;
mod match_candidates;
mod match_prior;
#[cfg(test)]
mod match_prior_oracle;
mod match_support;
#[cfg(test)]
mod match_support_oracle;
mod search;
#[cfg(test)]
mod smoothing_oracle;
mod sobel;
#[cfg(test)]
mod sobel_oracle;
mod stage;
#[cfg(test)]
mod stage_tests;
#[cfg(test)]
mod support_filters_oracle;
#[cfg(test)]
mod testing;
mod triangulation;

pub use config::ElasConfig;
pub(super) use stage::{Elas, kernels};
