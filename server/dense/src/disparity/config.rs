//! The `[disparity]` section.

use serde::Deserialize;

use super::elas::ElasConfig;
use crate::DenseError;
use crate::config::{all_positive, require};

/// Largest Hamming distance of two descriptors.
pub(super) const COST_MAX: u32 = 31;
/// Largest cost of one path: the sum of two fits a byte.
const PATH_COST_MAX: u32 = 127;
/// Most times that an image is halved.
const LEVEL_MAX: u32 = 4;

/// Options of stereo matching; every value lives in `config/server.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisparityConfig {
    /// How disparities are found.
    pub method: Method,
    /// Nearest tissue: sets the largest disparity.
    pub near_mm: f64,
    /// Farthest tissue: sets the smallest disparity.
    pub far_mm: f64,
    /// Smallest disparity, in place of that of `far_mm`.
    pub min_disparity_px: RangeEnd,
    /// Largest disparity, in place of that of `near_mm`.
    pub max_disparity_px: RangeEnd,
    /// Grey level from which a pixel is a highlight.
    pub saturated_level: u32,
    /// Level up to which all channels lie in a dark pixel or the black frame.
    pub dark_level: u32,
    /// Instrument masks are widened by this.
    pub mask_margin_px: u32,
    /// Largest angle between the line of sight and a surface's normal.
    pub incidence_max_deg: f64,
    /// Memory for the volumes of costs; larger images are matched in bands.
    pub volume_mib: u32,
    /// Rows by which bands overlap to each side.
    pub band_margin_px: u32,
    /// `[disparity.sgm]`.
    pub sgm: SgmConfig,
    /// `[disparity.elas]`.
    pub elas: ElasConfig,
    /// `[disparity.narrow]`.
    pub narrow: NarrowConfig,
    /// `[disparity.patch]`.
    pub patch: PatchConfig,
    /// `[disparity.filter]`.
    pub filter: FilterConfig,
    /// `[disparity.spread]`.
    pub spread: SpreadConfig,
}

/// How disparities are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Support points, their triangulation as a prior, and the candidates near them (Geiger et al. 2010).
    Elas,
    /// Census and semi-global matching (Hirschmueller 2008).
    Sgm,
}

/// One end of the disparity search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum RangeEnd {
    /// This disparity.
    Px(i32),
    /// From the rig and the working distance: the word `auto`.
    Auto(Auto),
}

/// The word `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Auto {
    /// The word `auto`.
    Auto,
}

/// Semi-global matching; costs are bits of 31.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SgmConfig {
    /// How often the image is halved before all disparities are searched.
    pub coarse_level: u32,
    /// Paths: 4 or 8.
    pub paths: u32,
    /// Penalty of a step of one disparity.
    pub small_penalty: u32,
    /// Penalty of a jump where grey values are even.
    pub jump_penalty_max: u32,
    /// Penalty of a jump across a grey edge, at least.
    pub jump_penalty_min: u32,
    /// Fall of the jump penalty per grey level.
    pub jump_penalty_per_level: f64,
    /// Cost of a masked pixel at any disparity.
    pub silent_cost: u32,
    /// By how much the best match elsewhere must be worse.
    pub uniqueness_percent: u32,
    /// Largest disagreement of the left and the right view.
    pub cross_check_px: i32,
    /// Share of the cost around a minimum that may be the small penalty's and is left out of sub-pixel refinement.
    pub subpixel_penalty_share: f64,
}

/// Matching of 16 disparities about the surface found at the next coarser level; costs are bits of 31.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NarrowConfig {
    /// The finest level that is matched so; 0 is the image itself.
    pub finest_level: u32,
    /// Penalty of a step of one disparity off the surface.
    pub small_penalty: u32,
    /// Penalty of a jump where grey values are even.
    pub jump_penalty_max: u32,
    /// Penalty of a jump across a grey edge, at least.
    pub jump_penalty_min: u32,
    /// Fall of the jump penalty per grey level.
    pub jump_penalty_per_level: f64,
    /// Gate about the surface's slope through a pixel's own disparity in the plane fit.
    pub gate_px: f64,
    /// Gate about the mean of what surrounds a hole, all of which must lie within for it to be filled.
    pub hole_gate_px: f64,
}

/// Inverse search of planar patches; pixels are those of the level.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchConfig {
    /// Rounds at the level that is searched.
    pub coarse_rounds: u32,
    /// Rounds at each finer level that is matched.
    pub finer_rounds: u32,
    /// Distance of the 5 x 5 samples of a patch, pixels of the level.
    pub stride_px: u32,
    /// Weight of a pixel's present disparity against its texture, squared grey levels per pixel.
    pub prior_weight: f64,
    /// Larger differences of grey between the eyes count as this.
    pub difference_max_levels: f64,
    /// Largest step of a pixel per round.
    pub step_max_px: f64,
    /// Gate about a pixel's own plane for others to take part in its patch.
    pub gate_px: f64,
    /// Largest move of a disparity per round.
    pub shift_max_px: f64,
    /// By how much a surface must be nearer to hide another from the right eye.
    pub hidden_tolerance_px: f64,
    /// Standard deviation under the best conditions; the whole is the root of the sum of the squares of these.
    pub floor_px: f64,
    /// Times the residual of the patch.
    pub residual_factor: f64,
    /// Grey levels of noise: divided by the root of the summed squared gradients of the patch.
    pub noise_levels: f64,
    /// Times the share of the patch that is not on its plane.
    pub missing_px: f64,
}

/// What is done to the matched disparities.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilterConfig {
    /// Disparity step within one surface.
    pub speckle_step_px: f64,
    /// Smaller surfaces are removed.
    pub speckle_area_px: u32,
    /// Gate about a pixel's own disparity in the first plane fit.
    pub first_gate_px: f64,
    /// Gate about the first plane in the second.
    pub second_gate_px: f64,
    /// Largest move of a disparity by the plane fit.
    pub shift_max_px: f64,
    /// Share of a 9 x 9 window that must be known for a hole to be filled.
    pub fill_share_min: f64,
}

/// Standard deviation of a disparity, as measured against true depth: the root of the sum of the squares of these.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpreadConfig {
    /// What remains under the best conditions.
    pub floor_px: f64,
    /// Times the residual of the plane fit.
    pub residual_factor: f64,
    /// Divided by the curvature of the costs per path.
    pub curvature_px: f64,
    /// Times the share of the window that is not on the plane.
    pub missing_px: f64,
}

impl DisparityConfig {
    /// Checks what the kernels rely on.
    ///
    /// # Errors
    /// [`DenseError::Config`] naming the first option that cannot be used.
    pub fn check(&self) -> Result<(), DenseError> {
        let ordered = self.near_mm > 0.0 && self.far_mm > self.near_mm && self.far_mm.is_finite();
        require(
            ordered,
            "disparity.far_mm",
            self.far_mm,
            "finite and above disparity.near_mm, that above 0",
        )?;
        let volume = f64::from(self.volume_mib);
        require(self.volume_mib > 0, "disparity.volume_mib", volume, "above 0")?;
        let incidence = self.incidence_max_deg;
        let is_acute = incidence > 0.0 && incidence <= 90.0;
        require(is_acute, "disparity.incidence_max_deg", incidence, "above 0 and at most 90")?;
        self.sgm.check()?;
        self.elas.check()?;
        self.narrow.check()?;
        self.patch.check()?;
        self.filter.check()?;
        self.spread.check()
    }
}

impl SgmConfig {
    fn check(&self) -> Result<(), DenseError> {
        let level = f64::from(self.coarse_level);
        require(self.coarse_level <= LEVEL_MAX, "disparity.sgm.coarse_level", level, "at most 4")?;
        let paths = f64::from(self.paths);
        require([4, 8].contains(&self.paths), "disparity.sgm.paths", paths, "4 or 8")?;
        let (small, low, high) = (self.small_penalty, self.jump_penalty_min, self.jump_penalty_max);
        let limit = high <= PATH_COST_MAX - COST_MAX;
        require(limit, "disparity.sgm.jump_penalty_max", f64::from(high), "at most 96")?;
        let ordered = small <= low && low <= high;
        let requirement = "between disparity.sgm.small_penalty and disparity.sgm.jump_penalty_max";
        require(ordered, "disparity.sgm.jump_penalty_min", f64::from(low), requirement)?;
        let fall = self.jump_penalty_per_level;
        let fall_fits = (0.0..=96.0).contains(&fall);
        require(fall_fits, "disparity.sgm.jump_penalty_per_level", fall, "from 0 to 96")?;
        let silent = f64::from(self.silent_cost);
        require(self.silent_cost <= COST_MAX, "disparity.sgm.silent_cost", silent, "at most 31")?;
        let unique = f64::from(self.uniqueness_percent);
        require(self.uniqueness_percent < 100, "disparity.sgm.uniqueness_percent", unique, "below 100")?;
        let share = self.subpixel_penalty_share;
        let below_one = (0.0..1.0).contains(&share);
        require(below_one, "disparity.sgm.subpixel_penalty_share", share, "from 0 to below 1")
    }
}

impl NarrowConfig {
    fn check(&self) -> Result<(), DenseError> {
        let (small, low, high) = (self.small_penalty, self.jump_penalty_min, self.jump_penalty_max);
        let limit = high <= PATH_COST_MAX - COST_MAX;
        require(limit, "disparity.narrow.jump_penalty_max", f64::from(high), "at most 96")?;
        let ordered = small <= low && low <= high;
        let requirement = "between disparity.narrow.small_penalty and disparity.narrow.jump_penalty_max";
        require(ordered, "disparity.narrow.jump_penalty_min", f64::from(low), requirement)?;
        let fall = self.jump_penalty_per_level;
        require(
            (0.0..=96.0).contains(&fall),
            "disparity.narrow.jump_penalty_per_level",
            fall,
            "from 0 to 96",
        )?;
        let gates = [
            ("disparity.narrow.gate_px", self.gate_px),
            ("disparity.narrow.hole_gate_px", self.hole_gate_px),
        ];
        all_positive(&gates)
    }
}

impl PatchConfig {
    fn check(&self) -> Result<(), DenseError> {
        let rounds = [
            ("disparity.patch.coarse_rounds", self.coarse_rounds),
            ("disparity.patch.finer_rounds", self.finer_rounds),
            ("disparity.patch.stride_px", self.stride_px),
        ];
        rounds
            .into_iter()
            .try_for_each(|(field, count)| require(count <= 16, field, f64::from(count), "at most 16"))?;
        let positive = [
            ("disparity.patch.prior_weight", self.prior_weight),
            ("disparity.patch.difference_max_levels", self.difference_max_levels),
            ("disparity.patch.step_max_px", self.step_max_px),
            ("disparity.patch.gate_px", self.gate_px),
            ("disparity.patch.shift_max_px", self.shift_max_px),
            ("disparity.patch.hidden_tolerance_px", self.hidden_tolerance_px),
            ("disparity.patch.floor_px", self.floor_px),
            ("disparity.patch.residual_factor", self.residual_factor),
            ("disparity.patch.noise_levels", self.noise_levels),
            ("disparity.patch.missing_px", self.missing_px),
        ];
        all_positive(&positive)
    }
}

impl FilterConfig {
    fn check(&self) -> Result<(), DenseError> {
        let positive = [
            ("disparity.filter.speckle_step_px", self.speckle_step_px),
            ("disparity.filter.first_gate_px", self.first_gate_px),
            ("disparity.filter.second_gate_px", self.second_gate_px),
            ("disparity.filter.shift_max_px", self.shift_max_px),
            ("disparity.filter.fill_share_min", self.fill_share_min),
        ];
        all_positive(&positive)
    }
}

impl SpreadConfig {
    fn check(&self) -> Result<(), DenseError> {
        let floor = self.floor_px;
        require(floor.is_finite() && floor > 0.0, "disparity.spread.floor_px", floor, "above 0")?;
        let factors = [
            ("disparity.spread.residual_factor", self.residual_factor),
            ("disparity.spread.curvature_px", self.curvature_px),
            ("disparity.spread.missing_px", self.missing_px),
        ];
        factors.into_iter().try_for_each(|(field, value)| {
            require(value.is_finite() && value >= 0.0, field, value, "a finite number from 0 up")
        })
    }
}
