//! Wrapper of `mark_candidates.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "mark_candidates",
    elas_text!("mark_candidates.wgsl"),
    &[Uniform, Uniform, Read, ReadWrite],
);

/// Reads the support points, writes the candidate disparities of the grid cells.
pub(super) fn bind(gpu: &Gpu, images: &Images, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let Buffers { search, plausible, candidates, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, search, plausible, candidates])
}
