//! Wrapper of `fill_triangles.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "fill_triangles",
    elas_text!("fill_triangles.wgsl"),
    &[Uniform, Uniform, Read, Read, ReadWrite],
);

/// Reads the triangles, writes which one each pixel lies in.
pub(super) fn bind(gpu: &Gpu, images: &Images, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let Buffers { strip_count, strips, corners, triangle_of, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, strip_count, strips, corners, triangle_of])
}
