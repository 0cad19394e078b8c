//! Wrapper of `fit_tone.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::Tone;
use crate::store::Row;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("fit_tone", include_str!("fit_tone.wgsl"), &[Read, ReadWrite]);

/// Reads `sums`, updates `tone`.
pub(super) fn bind(
    gpu: &Gpu,
    sums: &GpuBuffer<Row>,
    tone: &GpuBuffer<Tone>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[sums, tone])
}
