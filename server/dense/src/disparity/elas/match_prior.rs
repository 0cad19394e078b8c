//! Wrapper of `match_prior.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "match_prior",
    elas_text!("match_prior.wgsl"),
    &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite],
);

/// Reads the energies of the candidates and the triangles, writes the disparities of both views.
pub(super) fn bind(gpu: &Gpu, images: &Images, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let Buffers { search, descriptors, energies, triangle_of, planes, found, .. } = buffers;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[&images.whole, search, descriptors, energies, triangle_of, planes, found])
}
