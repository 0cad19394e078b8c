//! The `[dense]` section.

use serde::Deserialize;

use crate::{DenseError, FlowConfig, NodeConfig, WarpConfig};

/// What one dispatch reaches: 65,535 workgroups of 64. A claim key holds four times as many slots.
const SURFEL_LIMIT_MAX: u32 = 65_535 * 64;

/// Options of the surfel model; every value lives in `config/server.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DenseConfig {
    /// Side of a cell of the point grid: each keeps one surfel.
    pub surfel_spacing_mm: f64,
    /// Surfels there is room for at first.
    pub surfel_capacity: u32,
    /// Surfels the model may grow to; new ones beyond it are refused and counted.
    pub surfel_limit: u32,
    /// Cells of the index map per pixel and axis: 1, 2 or 4.
    pub index_map_scale: u32,
    /// Share of dead slots at which the arrays are compacted.
    pub compaction_dead_share: f64,
    /// Frames over which the correction of a closed loop is spread.
    pub bend_frames: u32,
    /// `[dense.nodes]`.
    pub nodes: NodeConfig,
    /// `[dense.warp]`.
    pub warp: WarpConfig,
    /// `[dense.flow]`.
    pub flow: FlowConfig,
    /// `[dense.fusion]`.
    pub fusion: FusionConfig,
    /// `[dense.color]`.
    pub color: ColorConfig,
    /// `[dense.rejection]`.
    pub rejection: RejectionConfig,
    /// `[dense.publish]`.
    pub publish: PublishConfig,
}

/// How a surfel registers to a measurement and is averaged with it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FusionConfig {
    /// Largest difference in depth.
    pub gate_mm: f64,
    /// Largest difference in depth in standard deviations, where that is more.
    pub gate_sigmas: f64,
    /// Largest angle between the normals.
    pub angle_max_deg: f64,
    /// Standard deviation of disparity up to which a measurement weighs 1.
    pub reference_sigma_px: f64,
    /// Least weight of a measurement.
    pub measurement_weight_min: f64,
    /// The paper's `omega_max`.
    pub weight_max: f32,
    /// The paper's `tau_weight`: from here on a surfel is stable.
    pub weight_stable: f32,
    /// The paper's `tau_time`: frames after which an unseen unstable surfel is deleted.
    pub unseen_frames_max: u32,
    /// A surfel this far in front of the measured surface is contradicted.
    pub free_space_gate_mm: f64,
    /// A surfel less far behind a measured surface that faces the same way is contradicted.
    pub doubled_gate_mm: f64,
    /// Weight that one contradiction of weight 1 takes away.
    pub contradiction_loss: f64,
    /// Radius around a registered surfel, in spacings, in which no new one is made.
    pub cover_radius_spacings: f64,
}

/// How colours are averaged.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColorConfig {
    /// Whether the light comes from the scope and falls off as `cos / d^2`.
    pub near_field: bool,
    /// Distance at which that light counts as 1.
    pub reference_distance_mm: f64,
    /// Power of the cosine to the optical axis by which the light falls off to the sides besides.
    pub axis_power: f32,
    /// Most weight of a colour.
    pub weight_max: f32,
    /// Levels by which a pixel may be brighter than its surfel before it counts as a highlight.
    pub highlight_levels: f32,
}

/// Which frames are not fused.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RejectionConfig {
    /// Mean back-projection error above which a frame is not fused.
    pub mean_error_max_mm: f64,
    /// Share of the measured pixels that must show the model for its error to count.
    pub overlap_min: f64,
    /// Frames rejected in a row after which the next one is fused all the same: the scene has changed.
    pub frames_in_row_max: u32,
    /// Width of a bin of the error histogram (1,024 bins; the last takes all that is beyond).
    pub error_bin_mm: f64,
}

/// How far what viewers hold may be from the model.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishConfig {
    /// Distance of positions, and difference of radii.
    pub position_mm: f64,
    /// Angle of normals.
    pub normal_deg: f64,
    /// Difference in any of red, green, blue (0-255).
    pub color_levels: f64,
    /// Difference in weight.
    pub weight_step: f64,
    /// A node whose motion moves nothing in its reach by more than this is not told to move.
    pub settled_mm: f64,
    /// Most changes read back at once; more come in further batches.
    pub batch: u32,
}

impl DenseConfig {
    /// Checks what the kernels rely on.
    ///
    /// # Errors
    /// [`DenseError::Config`] naming the first option that cannot be used.
    pub fn check(&self) -> Result<(), DenseError> {
        let fusion = &self.fusion;
        let positive = [
            ("dense.surfel_spacing_mm", self.surfel_spacing_mm),
            ("dense.fusion.gate_mm", fusion.gate_mm),
            ("dense.fusion.reference_sigma_px", fusion.reference_sigma_px),
            ("dense.fusion.measurement_weight_min", fusion.measurement_weight_min),
            ("dense.fusion.weight_max", f64::from(fusion.weight_max)),
            ("dense.fusion.weight_stable", f64::from(fusion.weight_stable)),
            ("dense.color.reference_distance_mm", self.color.reference_distance_mm),
            ("dense.color.weight_max", f64::from(self.color.weight_max)),
            ("dense.color.highlight_levels", f64::from(self.color.highlight_levels)),
            ("dense.rejection.error_bin_mm", self.rejection.error_bin_mm),
            ("dense.publish.batch", f64::from(self.publish.batch)),
            ("dense.surfel_capacity", f64::from(self.surfel_capacity)),
        ];
        all_positive(&positive)?;
        self.nodes.check()?;
        self.warp.check()?;
        self.flow.check()?;
        let scale = self.index_map_scale;
        require([1, 2, 4].contains(&scale), "dense.index_map_scale", f64::from(scale), "1, 2 or 4")?;
        let limit = self.surfel_limit;
        let in_range = limit >= self.surfel_capacity && limit <= SURFEL_LIMIT_MAX;
        let requirement = "at least dense.surfel_capacity and at most 4194240";
        require(in_range, "dense.surfel_limit", f64::from(limit), requirement)
    }
}

pub(crate) fn require(
    holds: bool,
    field: &'static str,
    value: f64,
    requirement: &'static str,
) -> Result<(), DenseError> {
    if holds { Ok(()) } else { Err(DenseError::Config { field, value, requirement }) }
}

/// Refuses the first value that is not a finite number above 0.
pub(crate) fn all_positive(values: &[(&'static str, f64)]) -> Result<(), DenseError> {
    values.iter().try_for_each(|&(field, value)| {
        require(value.is_finite() && value > 0.0, field, value, "a finite number above 0")
    })
}

/// Millimetres in the configuration, metres in kernels.
pub(crate) fn metres(mm: f64) -> f32 {
    (mm * 1e-3) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::config;

    #[test]
    fn the_shipped_configuration_is_usable() {
        config().check().unwrap();
    }

    #[test]
    fn an_unusable_value_is_named() {
        let refused = |change: fn(&mut DenseConfig)| {
            let mut changed = config();
            change(&mut changed);
            changed.check().unwrap_err().to_string()
        };
        assert!(
            refused(|c| c.index_map_scale = 3).starts_with("dense.index_map_scale = 3 must be 1, 2 or 4")
        );
        assert!(refused(|c| c.surfel_spacing_mm = f64::NAN).starts_with("dense.surfel_spacing_mm = NaN"));
        assert!(refused(|c| c.fusion.gate_mm = 0.0).starts_with("dense.fusion.gate_mm = 0"));
        assert!(refused(|c| c.surfel_limit = 1).starts_with("dense.surfel_limit = 1"));
        assert!(refused(|c| c.surfel_limit = SURFEL_LIMIT_MAX + 1).ends_with("at most 4194240"));
    }
}
