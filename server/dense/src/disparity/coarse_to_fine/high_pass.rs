//! Wrapper of `high_pass.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::band::Band;
use crate::preprocess::EyeBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "high_pass",
    concat!(include_str!("high_pass.wgsl"), include_str!("patch_views.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Read, Read, ReadWrite],
);

/// Rows of one invocation.
pub(super) const ROWS: u32 = 16;

/// Reads grey values and masks, writes the values without their local mean, in pairs.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    eye: &EyeBuffers,
    passed: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &eye.grey, &eye.masked, passed])
}
