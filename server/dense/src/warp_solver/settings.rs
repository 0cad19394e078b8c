//! `SolverSettings` and `SolverState` of `solver.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::WarpConfig;
use crate::config::metres;

/// Settings of one solve.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SolverSettings {
    pub columns: u32,
    pub rows: u32,
    pub stride: u32,
    pub matches: u32,
    pub patches: u32,
    pub room: u32,
    pub w_rot: f32,
    pub w_reg: f32,
    pub w_data: f32,
    pub w_corr: f32,
    pub w_flow: f32,
    pub w_r: f32,
    pub w_p: f32,
    pub w_rest: f32,
    pub w_rest_turn: f32,
    pub huber_mm: f32,
    pub match_huber_mm: f32,
    pub gate_m: f32,
    pub angle_cos_min: f32,
    pub reference_sigma_m: f32,
    pub damping: f32,
    pub energy_tolerance: f32,
    pub residual_tolerance: f32,
    pub hold_out: u32,
    pub hold_pose: u32,
}

impl SolverSettings {
    /// For images of `size`; no matches, room for all nodes.
    pub fn new(config: &WarpConfig, size: (u32, u32)) -> Self {
        let stride = config.stride_px(size.0, size.1);
        Self {
            columns: size.0.div_ceil(stride),
            rows: size.1.div_ceil(stride),
            stride,
            matches: 0,
            patches: 0,
            room: config.solved_max,
            w_rot: config.rotation_weight as f32,
            w_reg: config.smoothness_weight as f32,
            // each residual stands for the pixels around it
            w_data: (config.data_weight * f64::from(stride * stride)) as f32,
            w_corr: config.match_weight as f32,
            w_flow: config.flow_weight as f32,
            w_r: config.pose_turn_weight as f32,
            w_p: config.pose_shift_weight as f32,
            w_rest: config.rest_weight as f32,
            w_rest_turn: config.rest_turn_weight as f32,
            huber_mm: config.huber_mm as f32,
            match_huber_mm: config.match_huber_mm as f32,
            gate_m: metres(config.gate_mm),
            angle_cos_min: config.angle_max_deg.to_radians().cos() as f32,
            reference_sigma_m: metres(config.reference_sigma_mm),
            damping: config.damping as f32,
            energy_tolerance: config.energy_tolerance as f32,
            residual_tolerance: config.residual_tolerance as f32,
            hold_out: u32::from(config.hold_out),
            hold_pose: 0,
        }
    }

    /// Residuals of the grid and of all matches.
    pub fn residuals(&self) -> u32 {
        self.columns * self.rows + 3 * self.matches
    }
}

/// What the solver knows between its passes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SolverState {
    pub present: u32,
    pub fresh: u32,
    pub done: u32,
    pub settled: u32,
    pub solved: u32,
    pub observed: u32,
    pub accepted: u32,
    pub rejected: u32,
    pub damping: f32,
    pub energy: f32,
    pub first_energy: f32,
    pub step: f32,
    pub carry: f32,
    pub descent: f32,
    pub first_descent: f32,
    pub started: u32,
    pub poses: [[f32; 4]; 6],
    pub gradient: [f32; 6],
    pub matrix: [f32; 36],
    pub inverse: [f32; 36],
    pub along: [f32; 6],
    pub pulled: [f32; 6],
    pub stepped: [f32; 6],
}
