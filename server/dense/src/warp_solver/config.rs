//! `[dense.warp]`: the energy and its solver.

use serde::Deserialize;

use crate::DenseError;
use crate::config::{all_positive, require};

/// The most nodes solved that a configuration may ask for.
const SOLVED_LIMIT: u32 = 8192;

/// Options of the warp's solve. Weights are for squared millimetres, and radians, as the paper's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarpConfig {
    /// Whether the model deforms; without, it is rigid.
    pub enabled: bool,
    /// Whether the solver leaves out the pixels of `shared/held_out.wgsl`, for measuring what it does elsewhere.
    pub hold_out: bool,
    /// Steps of Levenberg-Marquardt.
    pub iterations: u32,
    /// Steps of conjugate gradients in each.
    pub descent_steps: u32,
    /// The most data residuals: pixels are taken on a grid that has no more.
    pub residuals_max: u32,
    /// The most matches of the tracker.
    pub matches_max: u32,
    /// The most nodes solved in a frame.
    pub solved_max: u32,
    /// The paper's `w_rot`.
    pub rotation_weight: f64,
    /// The paper's `w_reg`.
    pub smoothness_weight: f64,
    /// The paper's `w_data`.
    pub data_weight: f64,
    /// The paper's `w_corr`, of the tracker's matches.
    pub match_weight: f64,
    /// The same of the patches that were followed.
    pub flow_weight: f64,
    /// The paper's `w_r`, per square radian.
    pub pose_turn_weight: f64,
    /// The paper's `w_p`.
    pub pose_shift_weight: f64,
    /// Weight of a node's way: what could be the camera's motion is not the tissue's.
    pub rest_weight: f64,
    /// The same of its turn and stretch: the difference of `A` and the identity.
    pub rest_turn_weight: f64,
    /// Where Huber's kernel of a data residual turns linear, for a measurement of the reference spread.
    pub huber_mm: f64,
    /// The same of a match.
    pub match_huber_mm: f64,
    /// The paper's `epsilon_d`: distance of a point from its measurement.
    pub gate_mm: f64,
    /// The paper's `epsilon_n`: angle of their normals.
    pub angle_max_deg: f64,
    /// Standard deviation of a depth at which, or below which, a residual has its full weight.
    pub reference_sigma_mm: f64,
    /// Damping of the first step.
    pub damping: f64,
    /// Relative decrease of the energy at which the solve ends.
    pub energy_tolerance: f64,
    /// Relative residual at which conjugate gradients end.
    pub residual_tolerance: f64,
}

impl WarpConfig {
    /// Checks what the kernels rely on.
    pub(crate) fn check(&self) -> Result<(), DenseError> {
        let positive = [
            ("dense.warp.pose_turn_weight", self.pose_turn_weight),
            ("dense.warp.pose_shift_weight", self.pose_shift_weight),
            ("dense.warp.rotation_weight", self.rotation_weight),
            ("dense.warp.smoothness_weight", self.smoothness_weight),
            ("dense.warp.rest_weight", self.rest_weight),
            ("dense.warp.rest_turn_weight", self.rest_turn_weight),
            ("dense.warp.flow_weight", self.flow_weight),
            ("dense.warp.huber_mm", self.huber_mm),
            ("dense.warp.match_huber_mm", self.match_huber_mm),
            ("dense.warp.gate_mm", self.gate_mm),
            ("dense.warp.reference_sigma_mm", self.reference_sigma_mm),
            ("dense.warp.damping", self.damping),
            ("dense.warp.residuals_max", f64::from(self.residuals_max)),
        ];
        all_positive(&positive)?;
        let solved = self.solved_max;
        let usable = (1..=SOLVED_LIMIT).contains(&solved);
        require(usable, "dense.warp.solved_max", f64::from(solved), "from 1 to 8192")
    }

    /// Pixels between residuals, so that an image of `width` x `height` gives no more than allowed.
    pub(crate) fn stride_px(&self, width: u32, height: u32) -> u32 {
        let fits = |stride: &u32| {
            u64::from(width.div_ceil(*stride)) * u64::from(height.div_ceil(*stride))
                <= u64::from(self.residuals_max)
        };
        (1..=width.max(height)).find(fits).unwrap_or(width.max(height))
    }
}
