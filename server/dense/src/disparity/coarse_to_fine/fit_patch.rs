//! Wrapper of `fit_patch.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::aim_patch::PatchTarget;
use crate::disparity::PatchConfig;
use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "fit_patch",
    concat!(
        include_str!("fit_patch.wgsl"),
        include_str!("patch_targets.wgsl"),
        include_str!("../common.wgsl")
    ),
    &[Uniform, Uniform, Read, ReadWrite],
);

/// `Patch` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Patch {
    pub stride: i32,
    pub gate: f32,
    pub shift_max: f32,
    pub sigma_floor: f32,
    pub residual_factor: f32,
    pub noise_levels: f32,
    pub missing_factor: f32,
    padding: f32,
}

impl Patch {
    pub fn new(config: &PatchConfig) -> Self {
        Self {
            stride: config.stride_px as i32,
            gate: config.gate_px as f32,
            shift_max: config.shift_max_px as f32,
            sigma_floor: config.floor_px as f32,
            residual_factor: config.residual_factor as f32,
            noise_levels: config.noise_levels as f32,
            missing_factor: config.missing_px as f32,
            padding: 0.0,
        }
    }
}

/// Reads what the pixels ask for, writes the planes.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    patch: &Patch,
    targets: &GpuBuffer<PatchTarget>,
    planes: &GpuBuffer<[f32; 4]>,
) -> Result<BoundKernel, GpuError> {
    let patch = gpu.uniform("patch", patch)?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &patch, targets, planes])
}
