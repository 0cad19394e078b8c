//! Wrapper of `pool_targets.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::aim_patch::PatchTarget;
use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "pool_targets",
    concat!(
        include_str!("pool_targets.wgsl"),
        include_str!("patch_targets.wgsl"),
        include_str!("../common.wgsl")
    ),
    &[Uniform, Uniform, Read, Read, ReadWrite],
);

/// `Pool` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Pool {
    gate: f32,
    padding: [f32; 3],
}

/// Reads what the cells ask for and their planes, writes it joined with the neighbours'.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    gate_px: f64,
    (targets, planes): (&GpuBuffer<PatchTarget>, &GpuBuffer<[f32; 4]>),
    pooled: &GpuBuffer<PatchTarget>,
) -> Result<BoundKernel, GpuError> {
    let pool = gpu.uniform("pool", &Pool { gate: gate_px as f32, padding: [0.0; 3] })?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &pool, targets, planes, pooled])
}
