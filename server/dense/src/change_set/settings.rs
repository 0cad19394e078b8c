//! The bounds and steps of publishing, for the kernels.

use bytemuck::{Pod, Zeroable};

use crate::config::{PublishConfig, metres};

/// What f32 arithmetic may move a surfel by at a viewer between two times that it is sent, beyond what it moves the
/// published copy here: a warp rounds by some 4e-9 m (1.2e-8 m at most) at 0.05 m from the origin, at random, so that
/// the thousands of warps of a minute stay below this.
const ARITHMETIC_SLACK_M: f64 = 2e-6;

/// How finely what is published is encoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncodingSteps {
    /// Grid of surfel positions, metres.
    pub position_m: f64,
    /// Largest coordinate of a surfel, metres.
    pub position_max_m: f64,
    /// Node positions and translations, metres.
    pub node_m: f64,
    /// Elements of A - I.
    pub affine: f64,
}

/// `PublishSettings` of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PublishSettings {
    pub slots: u32,
    pub batch: u32,
    pub position_m: f32,
    pub normal_cos: f32,
    pub color_levels: f32,
    pub weight_step: f32,
    pub position_step_m: f32,
    pub position_max_m: f32,
    pub node_step_m: f32,
    pub affine_step: f32,
    pub settled_m: f32,
    pub reach_m: f32,
}

impl PublishSettings {
    /// Such that every viewer is within the configured bound, whenever it joined: the rounding of a late joiner's
    /// positions and the slack of arithmetic come off it.
    pub fn new(config: &PublishConfig, steps: &EncodingSteps, reach_m: f32, slots: u32) -> Self {
        let rounding_m = 3.0_f64.sqrt() / 2.0 * steps.position_m;
        let position_m = 1e-3 * config.position_mm - rounding_m - ARITHMETIC_SLACK_M;
        Self {
            slots,
            batch: config.batch,
            position_m: position_m.max(0.0) as f32,
            normal_cos: config.normal_deg.to_radians().cos() as f32,
            color_levels: config.color_levels as f32,
            weight_step: config.weight_step as f32,
            position_step_m: steps.position_m as f32,
            position_max_m: steps.position_max_m as f32,
            node_step_m: steps.node_m as f32,
            affine_step: steps.affine as f32,
            settled_m: metres(config.settled_mm),
            reach_m,
        }
    }
}
