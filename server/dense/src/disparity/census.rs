//! Wrapper of `census.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::band::Band;
use crate::preprocess::EyeBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "census",
    concat!(include_str!("census.wgsl"), include_str!("common.wgsl")),
    &[Uniform, Read, Read, ReadWrite],
);

/// Reads one eye's grey values and mask, writes its descriptors.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    eye: &EyeBuffers,
    descriptors: &GpuBuffer<[u32; 4]>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &eye.luma, &eye.masked, descriptors])
}
