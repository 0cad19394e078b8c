//! Wrapper of `aim_patch.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::PatchConfig;
use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "aim_patch",
    concat!(
        include_str!("aim_patch.wgsl"),
        include_str!("patch_views.wgsl"),
        include_str!("patch_targets.wgsl"),
        include_str!("../common.wgsl")
    ),
    &[Uniform, Uniform, Read, Read, Read, ReadWrite],
);

/// `PatchTarget` of the WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(in crate::disparity) struct PatchTarget {
    /// Pixels.
    pub disparity: f32,
    /// Two halves.
    pub step_and_texture: u32,
}

/// `Aim` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Aim {
    cell: u32,
    width: u32,
    height: u32,
    prior_weight: f32,
    difference_max: f32,
    step_max: f32,
    padding: [f32; 2],
}

/// Reads planes and the high-passed eyes, whose size and whose pixels to a cell are given; writes what each cell asks for.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    config: &PatchConfig,
    ((width, height), cell): ((u32, u32), u32),
    [left, right]: &[GpuBuffer<u32>; 2],
    (planes, targets): (&GpuBuffer<[f32; 4]>, &GpuBuffer<PatchTarget>),
) -> Result<BoundKernel, GpuError> {
    let aim = Aim {
        cell,
        width,
        height,
        prior_weight: config.prior_weight as f32,
        difference_max: config.difference_max_levels as f32,
        step_max: config.step_max_px as f32,
        padding: [0.0; 2],
    };
    let aim = gpu.uniform("aim", &aim)?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &aim, planes, left, right, targets])
}
