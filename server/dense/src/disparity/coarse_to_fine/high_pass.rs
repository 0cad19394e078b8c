//! Wrapper of `high_pass.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "high_pass",
    concat!(include_str!("high_pass.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Read, ReadWrite],
);

/// Rows of one invocation.
pub(super) const ROWS: u32 = 16;

/// Reads grey values, writes them without their local mean.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    grey: &GpuBuffer<f32>,
    passed: &GpuBuffer<f32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, grey, passed])
}
