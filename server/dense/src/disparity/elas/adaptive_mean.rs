//! Wrapper of `adaptive_mean.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "adaptive_mean",
    elas_text!("adaptive_mean.wgsl"),
    &[Uniform, Uniform, Read, ReadWrite],
);

/// `Direction` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Direction {
    pub along_columns: u32,
    pub padding: [u32; 3],
}

/// Reads `source`, writes `smoothed`, both disparity images.
pub(super) fn bind(
    gpu: &Gpu,
    direction: &Direction,
    images: &Images,
    [source, smoothed]: [&GpuBuffer<[f32; 4]>; 2],
) -> Result<BoundKernel, GpuError> {
    let direction = gpu.uniform("direction", direction)?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, &direction, source, smoothed])
}
