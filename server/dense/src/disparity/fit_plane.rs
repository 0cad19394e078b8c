//! Wrapper of `fit_plane.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Images;
use super::config::DisparityConfig;
use crate::preprocess::EyeBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "fit_plane",
    concat!(include_str!("fit_plane.wgsl"), include_str!("common.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, ReadWrite],
);

/// `PlaneFit` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PlaneFit {
    pub first_gate: f32,
    pub second_gate: f32,
    pub hole_gate: f32,
    pub shift_max: f32,
    pub fill_share_min: f32,
    pub sigma_floor: f32,
    pub residual_factor: f32,
    pub missing: f32,
    pub has_prior: u32,
    padding: [u32; 3],
}

impl PlaneFit {
    pub fn new(config: &DisparityConfig) -> Self {
        let (filter, spread) = (&config.filter, &config.spread);
        Self {
            first_gate: filter.first_gate_px as f32,
            second_gate: filter.second_gate_px as f32,
            hole_gate: 2.0 * filter.first_gate_px as f32,
            shift_max: filter.shift_max_px as f32,
            fill_share_min: filter.fill_share_min as f32,
            sigma_floor: spread.floor_px as f32,
            residual_factor: spread.residual_factor as f32,
            missing: spread.missing_px as f32,
            has_prior: 0,
            padding: [0; 3],
        }
    }

    /// One pass about the slopes of the planes that are there already, in place of the first.
    pub fn about_prior(self, gate_px: f64, hole_gate_px: f64) -> Self {
        Self { second_gate: gate_px as f32, hole_gate: hole_gate_px as f32, has_prior: 1, ..self }
    }
}

/// Reads the filtered disparities, writes the planes.
pub(super) fn bind(
    gpu: &Gpu,
    images: &Images,
    left: &EyeBuffers,
    fit: &PlaneFit,
) -> Result<BoundKernel, GpuError> {
    let fit = gpu.uniform("plane fit", fit)?;
    let Images { whole, filtered, spreads, planes, .. } = images;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &fit, filtered, spreads, &left.masked, planes])
}
