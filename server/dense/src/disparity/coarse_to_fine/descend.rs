//! Wrapper of `descend.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "descend",
    concat!(include_str!("descend.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Uniform, Read, ReadWrite],
);

/// `Descent` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Descent {
    coarse_width: u32,
    coarse_height: u32,
    padding: [u32; 2],
}

/// Reads planes of `coarse_size`, writes those of the next finer level.
pub(super) fn bind(
    gpu: &Gpu,
    fine_whole: &GpuBuffer<Band>,
    (coarse_width, coarse_height): (u32, u32),
    coarse: &GpuBuffer<[f32; 4]>,
    fine: &GpuBuffer<[f32; 4]>,
) -> Result<BoundKernel, GpuError> {
    let descent = gpu.uniform("descent", &Descent { coarse_width, coarse_height, padding: [0; 2] })?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[fine_whole, &descent, coarse, fine])
}
