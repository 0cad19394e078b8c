//! Wrapper of `match_candidates.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "match_candidates",
    elas_text!("match_candidates.wgsl"),
    &[Uniform, Uniform, Read, Read, ReadWrite],
);

/// Reads descriptors and candidates, writes each pixel's least energy among them.
pub(super) fn bind(gpu: &Gpu, images: &Images, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let Buffers { search, descriptors, candidates, energies, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, search, descriptors, candidates, energies])
}
