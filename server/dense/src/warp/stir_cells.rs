//! Wrapper of `stir_cells.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::WarpParts;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("stir_cells", include_str!("stir_cells.wgsl"), &[Uniform, Read, Read, ReadWrite]);

/// Reads the warp, writes `stirred` per bucket.
pub(super) fn bind(gpu: &Gpu, parts: &WarpParts, stirred: &GpuBuffer<u32>) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[parts.settings, parts.rows, parts.transforms, stirred])
}
