//! Wrapper of `drop_implausible.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "drop_implausible",
    concat!(include_str!("drop_implausible.wgsl"), include_str!("search.wgsl")),
    &[Uniform, Read, ReadWrite],
);

/// Reads the support points, writes the plausible ones.
pub(super) fn bind(gpu: &Gpu, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let Buffers { search, support, plausible, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[search, support, plausible])
}
