//! Wrapper of `aim_patch.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::PatchConfig;
use crate::disparity::band::Band;
use crate::preprocess::Eyes;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "aim_patch",
    concat!(include_str!("aim_patch.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, Read, Read, ReadWrite],
);

/// `Aim` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Aim {
    cell: u32,
    width: u32,
    height: u32,
    words: u32,
    prior_weight: f32,
    difference_max: f32,
    step_max: f32,
    padding: f32,
}

/// The images that patches are matched in.
#[derive(Clone, Copy, Debug)]
pub(in crate::disparity) struct Views<'a> {
    pub eyes: Eyes<'a>,
    /// Columns, rows.
    pub size: (u32, u32),
    /// Pixels to a side of one element of the planes.
    pub cell: u32,
}

/// Reads planes and the high-passed eyes, writes what each cell asks for.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    config: &PatchConfig,
    (views, passed): (Views, &[GpuBuffer<f32>; 2]),
    (planes, targets): (&GpuBuffer<[f32; 4]>, &GpuBuffer<[f32; 4]>),
) -> Result<BoundKernel, GpuError> {
    let Views { eyes, size: (width, height), cell } = views;
    let aim = Aim {
        cell,
        width,
        height,
        words: width.div_ceil(4),
        prior_weight: config.prior_weight as f32,
        difference_max: config.difference_max_levels as f32,
        step_max: config.step_max_px as f32,
        padding: 0.0,
    };
    let aim = gpu.uniform("aim", &aim)?;
    let [left, right] = passed;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[whole, &aim, planes, left, right, &eyes.left.masked, &eyes.right.masked, targets])
}
