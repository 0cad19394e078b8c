//! Wrapper of `match_support.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "match_support",
    elas_text!("match_support.wgsl"),
    &[Uniform, Uniform, Read, ReadWrite],
);

/// Reads the descriptors, writes the support points.
pub(super) fn bind(gpu: &Gpu, images: &Images, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let Buffers { search, descriptors, support, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, search, descriptors, support])
}
