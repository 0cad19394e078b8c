//! Which disparities are searched.

use geometry::StereoRig;

use super::config::{DisparityConfig, RangeEnd};
use super::unroll::GROUPS_MAX;
use crate::DenseError;

/// Disparities of one group: one vec4 of four words of bytes.
pub(super) const GROUP: u32 = 16;

/// The disparities `min_px..min_px + 16 * groups`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DisparityRange {
    /// Smallest disparity, a multiple of four.
    pub min_px: i32,
    /// Groups of 16 disparities.
    pub groups: u32,
}

impl DisparityRange {
    /// The range that holds `min_px..=max_px`, widened to what the kernels take.
    ///
    /// # Errors
    /// [`DenseError::Config`] where it is empty or wider than 320 disparities.
    pub fn new(min_px: i32, max_px: i32) -> Result<Self, DenseError> {
        let start = min_px.div_euclid(4) * 4;
        // one more to each side: a match at either end has no neighbour to be refined with
        let count = i64::from(max_px) + 2 - i64::from(start);
        let limit = i64::from(GROUP) * GROUPS_MAX as i64;
        if max_px <= min_px || count > limit {
            return Err(DenseError::Config {
                field: "disparity.max_disparity_px",
                value: f64::from(max_px),
                requirement: "above the smallest disparity, by at most 318",
            });
        }
        Ok(Self { min_px: start, groups: (count as u32).div_ceil(GROUP) })
    }

    /// The disparities of the configured working distance in front of `rig`, or those set in their place.
    ///
    /// # Errors
    /// As [`DisparityRange::new`].
    pub fn of_rig(rig: &StereoRig, config: &DisparityConfig) -> Result<Self, DenseError> {
        let at = |distance_mm: f64| rig.disparity_px(distance_mm * 1e-3);
        let min_px = match config.min_disparity_px {
            RangeEnd::Px(px) => px,
            RangeEnd::Auto(_) => at(config.far_mm).floor() as i32,
        };
        let max_px = match config.max_disparity_px {
            RangeEnd::Px(px) => px,
            RangeEnd::Auto(_) => at(config.near_mm).ceil() as i32,
        };
        let width_px = rig.left.width_px as i32;
        Self::new(min_px, max_px.min(min_px.saturating_add(width_px)).min(width_px - 1))
    }

    /// The range of the same disparities in images halved `times` times.
    ///
    /// # Errors
    /// As [`DisparityRange::new`].
    pub(super) fn halved(&self, times: u32) -> Result<Self, DenseError> {
        if times == 0 {
            return Ok(*self);
        }
        let scale = 1 << times;
        let max_px = self.min_px + self.count() as i32 - 1;
        Self::new(self.min_px.div_euclid(scale), max_px.div_euclid(scale) + 1)
    }

    /// Disparities.
    pub fn count(&self) -> u32 {
        GROUP * self.groups
    }
}
