//! Wrapper of `mark_lifted.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("mark_lifted", include_str!("mark_lifted.wgsl"), &[Uniform, Read, ReadWrite]);

/// Reads the claims, writes the flags of the lifted pixels.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&frame.settings, &frame.claims, &frame.lifted.flags])
}
