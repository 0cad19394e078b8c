//! Wrapper of `median.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "median",
    concat!(include_str!("median.wgsl"), include_str!("common.wgsl")),
    &[Uniform, Read, ReadWrite],
);

/// Reads the matched disparities, writes the filtered ones.
pub(super) fn bind(gpu: &Gpu, images: &Images) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, &images.matched, &images.filtered])
}
