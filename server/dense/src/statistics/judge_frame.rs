//! Wrapper of `judge_frame.wgsl`.

use gpu::Binding::{ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("judge_frame", include_str!("judge_frame.wgsl"), &[Uniform, ReadWrite]);

/// Reads the histogram, writes the verdict.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&frame.settings, &frame.results])
}
