//! Wrapper of `mark_kept.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::store::SurfelStore;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("mark_kept", include_str!("mark_kept.wgsl"), &[Uniform, Read, Read, ReadWrite]);

/// Reads the states, writes the flags `kept`.
pub(super) fn bind(
    gpu: &Gpu,
    slots: &GpuBuffer<u32>,
    store: &SurfelStore,
    kept: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[slots, &store.history, &store.held.rest, kept])
}
