//! Wrapper of `write_visible.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum};

use super::SplatSettings;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "write_visible",
    concat!(include_str!("write_visible.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads `masks` and the sum of their counts, writes (`slots`, `groups`).
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<SplatSettings>,
    (masks, chunks): (&GpuBuffer<u32>, &PrefixSum),
    (slots, groups): (&GpuBuffer<u32>, &GpuBuffer<u32>),
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[settings, masks, &chunks.offsets, &chunks.total, slots, groups])
}
