//! Disparity of a rectified pair on the GPU: centre-symmetric census, semi-global matching, checks, filters.
//!
//! [`DisparityStage`] records into a frame's submission; [`compute`] matches one pair and reads the result back. Both
//! give a disparity, its slopes and its standard deviation per left pixel. Nothing is read back in between.

mod aggregate;
#[cfg(test)]
mod aggregate_oracle;
mod band;
mod buffers;
mod census;
#[cfg(test)]
mod census_oracle;
mod coarse_to_fine;
mod compute;
mod config;
mod cross_check;
mod elas;
mod eyes;
mod fit_plane;
#[cfg(test)]
mod fit_plane_oracle;
mod matching_cost;
#[cfg(test)]
mod matching_cost_oracle;
mod median;
#[cfg(test)]
mod median_oracle;
mod range;
mod semi_global;
mod speckle;
#[cfg(test)]
mod speckle_oracle;
mod stage;
#[cfg(test)]
mod stage_tests;
#[cfg(test)]
pub(crate) mod testing;
mod unroll;
mod winner;
#[cfg(test)]
mod winner_oracle;

pub use compute::{DisparityMap, Pair, compute};
pub use config::{
    Auto, DisparityConfig, FilterConfig, Method, NarrowConfig, PatchConfig, RangeEnd, SgmConfig, SpreadConfig,
};
pub use elas::ElasConfig;
pub use eyes::{EyeOrder, eye_order};
pub use range::DisparityRange;
pub use stage::DisparityStage;
pub(crate) use stage::kernels;
