//! `FusionSettings` of `shared/fusion.wgsl`.

use bytemuck::{Pod, Zeroable};

use crate::config::{DenseConfig, metres};

/// Bins of the error histogram.
pub(crate) const ERROR_BINS: usize = 1024;
/// Place of the histogram in the results.
pub(crate) const HISTOGRAM: usize = 8;
/// Place of the held-out pixels' histogram.
pub(crate) const HELD_OUT_HISTOGRAM: usize = HISTOGRAM + ERROR_BINS;
/// Length of the results.
pub(crate) const RESULTS: usize = HELD_OUT_HISTOGRAM + ERROR_BINS;

/// Settings of one fused frame; metres, frames.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FusionSettings {
    pub slots: u32,
    pub capacity: u32,
    pub frame: u32,
    pub next_id: u32,
    pub gate_m: f32,
    pub gate_sigmas: f32,
    pub angle_cos_min: f32,
    pub reference_sigma_per_square_depth: f32,
    pub weight_min: f32,
    pub weight_max: f32,
    pub weight_stable: f32,
    pub unseen_frames_max: u32,
    pub free_space_gate_m: f32,
    pub contradiction_loss: f32,
    pub spacing_m: f32,
    pub cover_radius_m: f32,
    pub table_mask: u32,
    pub seed: u32,
    pub error_bin_m: f32,
    pub error_max_m: f32,
    pub overlap_min: f32,
    pub accept_always: u32,
    pub doubled_gate_m: f32,
    pub near_field: u32,
    pub reference_distance_m: f32,
    pub axis_power: f32,
    pub color_weight_max: f32,
    pub highlight_levels: f32,
}

impl FusionSettings {
    /// What stays the same from frame to frame; the counters are zero. A disparity's standard deviation is that of a
    /// depth times `focal_baseline / z^2`, with focal length times baseline in px m.
    pub fn new(config: &DenseConfig, focal_baseline: f64, table_places: u32) -> Self {
        let (fusion, rejection, color) = (&config.fusion, &config.rejection, &config.color);
        Self {
            gate_m: metres(fusion.gate_mm),
            gate_sigmas: fusion.gate_sigmas as f32,
            angle_cos_min: fusion.angle_max_deg.to_radians().cos() as f32,
            reference_sigma_per_square_depth: (fusion.reference_sigma_px / focal_baseline) as f32,
            weight_min: fusion.measurement_weight_min as f32,
            weight_max: fusion.weight_max,
            weight_stable: fusion.weight_stable,
            unseen_frames_max: fusion.unseen_frames_max,
            free_space_gate_m: metres(fusion.free_space_gate_mm),
            contradiction_loss: fusion.contradiction_loss as f32,
            doubled_gate_m: metres(fusion.doubled_gate_mm),
            spacing_m: metres(config.surfel_spacing_mm),
            cover_radius_m: metres(config.surfel_spacing_mm * fusion.cover_radius_spacings),
            table_mask: table_places - 1,
            error_bin_m: metres(rejection.error_bin_mm),
            error_max_m: metres(rejection.mean_error_max_mm),
            overlap_min: rejection.overlap_min as f32,
            near_field: u32::from(color.near_field),
            reference_distance_m: metres(color.reference_distance_mm),
            axis_power: color.axis_power,
            color_weight_max: color.weight_max,
            highlight_levels: color.highlight_levels,
            ..Self::zeroed()
        }
    }
}
