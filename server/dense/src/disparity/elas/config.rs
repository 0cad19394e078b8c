//! The `[disparity.elas]` section: parameters by the names under which they were published.

use serde::Deserialize;

use crate::DenseError;
use crate::config::{all_positive, require};

/// Most disparities searched to each side of the prior: what the table of its bonuses holds.
const RADIUS_MAX: f64 = 15.0;

/// Options of ELAS; the range of disparities is that of `[disparity]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElasConfig {
    /// Spacing of the candidates for support points, px.
    pub candidate_stepsize: u32,
    /// Largest cost of a support point in terms of the best elsewhere.
    pub support_threshold: f64,
    /// Least texture of a support point, sum of 16 responses.
    pub support_texture: u32,
    /// Half the window in which a support point is compared with others, candidates.
    pub incon_window_size: u32,
    /// Largest difference of support points that agree, px.
    pub incon_threshold: u32,
    /// Fewest support points, itself counted, that agree with one that stays.
    pub incon_min_support: u32,
    /// Distance within which a support point makes another redundant, candidates.
    pub redun_max_dist: u32,
    /// Largest difference of support points that say the same, px.
    pub redun_threshold: u32,
    /// Whether the image's corners become support points, with the disparity of the nearest one.
    pub add_corners: bool,
    /// Side of the cells that candidate disparities are gathered in, px.
    pub grid_size: u32,
    /// Weight of the images against the prior.
    pub beta: f64,
    /// Weight of the uniform part of the prior.
    pub gamma: f64,
    /// Standard deviation of the prior, px.
    pub sigma: f64,
    /// Standard deviations of the prior that are searched.
    pub sradius: f64,
    /// Least texture of a pixel, sum of 16 responses.
    pub match_texture: u32,
    /// Whether a pixel far from any support point is matched about its plane alone.
    pub prior_alone: bool,
    /// Largest disagreement of the left and the right view, px.
    pub lr_threshold: f64,
    /// Disparity step within one surface, px.
    pub speckle_sim_threshold: f64,
    /// Smaller surfaces are removed, pixels.
    pub speckle_size: u32,
    /// Longest gap along a row or a column that is closed, px.
    pub ipol_gap_width: u32,
    /// Whether a 3 x 3 median is applied.
    pub filter_median: bool,
    /// Whether the adaptive mean is applied.
    pub filter_adaptive_mean: bool,
    /// Rounds of inverse search of planar patches at the end, by `[disparity.patch]`; not part of the publication.
    pub patch_rounds: u32,
    /// As `disparity.patch.noise_levels`, for these rounds.
    pub patch_noise_levels: f64,
    /// Standard deviation of a match whose cost rises by 1 to both sides together, px.
    pub rise_sigma_px: f64,
}

impl ElasConfig {
    /// Checks what the kernels rely on.
    ///
    /// # Errors
    /// [`DenseError::Config`] naming the first option that cannot be used.
    pub fn check(&self) -> Result<(), DenseError> {
        let above_zero = [
            ("disparity.elas.support_threshold", self.support_threshold),
            ("disparity.elas.beta", self.beta),
            ("disparity.elas.gamma", self.gamma),
            ("disparity.elas.sigma", self.sigma),
            ("disparity.elas.sradius", self.sradius),
            ("disparity.elas.speckle_sim_threshold", self.speckle_sim_threshold),
        ];
        all_positive(&above_zero)?;
        let from_zero = [
            ("disparity.elas.lr_threshold", self.lr_threshold),
            ("disparity.elas.rise_sigma_px", self.rise_sigma_px),
            ("disparity.elas.patch_noise_levels", self.patch_noise_levels),
        ];
        for (field, value) in from_zero {
            require(value.is_finite() && value >= 0.0, field, value, "a finite number from 0 up")?;
        }
        self.check_sizes()?;
        let radius = self.radius();
        require(
            radius <= RADIUS_MAX,
            "disparity.elas.sradius",
            radius,
            "at most 15 with disparity.elas.sigma",
        )
    }

    fn check_sizes(&self) -> Result<(), DenseError> {
        let sizes = [
            ("disparity.elas.candidate_stepsize", self.candidate_stepsize, 1),
            ("disparity.elas.grid_size", self.grid_size, 4),
            ("disparity.elas.incon_window_size", self.incon_window_size, 0),
            ("disparity.elas.redun_max_dist", self.redun_max_dist, 0),
            ("disparity.elas.incon_threshold", self.incon_threshold, 0),
            ("disparity.elas.redun_threshold", self.redun_threshold, 0),
            ("disparity.elas.ipol_gap_width", self.ipol_gap_width, 0),
            ("disparity.elas.patch_rounds", self.patch_rounds, 0),
        ];
        sizes.into_iter().try_for_each(|(field, value, least)| {
            let fits = (least..=10_000).contains(&value);
            let requirement = if least == 4 { "from 4 to 10000" } else { "a small whole number" };
            require(fits, field, f64::from(value), requirement)
        })
    }

    /// Disparities searched to each side of the prior's, at least 2.
    pub(super) fn radius(&self) -> f64 {
        (self.sigma * self.sradius).ceil().max(2.0)
    }
}
