//! Wrapper of `fill_holes.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "fill_holes",
    concat!(include_str!("fill_holes.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Uniform, Read, ReadWrite],
);

/// Pixels between the samples of the windows, one run after the other: the last reaches 108 pixels far. An even number
/// of runs between two buffers ends in the first.
pub(super) const STRIDES: [i32; 4] = [2, 6, 18, 54];

/// `Filling` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Filling {
    stride: i32,
    padding: [u32; 3],
}

/// Reads planes, writes them with holes filled.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    stride: i32,
    source: &GpuBuffer<[f32; 4]>,
    filled: &GpuBuffer<[f32; 4]>,
) -> Result<BoundKernel, GpuError> {
    let filling = gpu.uniform("filling", &Filling { stride, padding: [0; 3] })?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &filling, source, filled])
}
