//! Wrapper of `move_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::store::{Bits, Row};

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("move_nodes", include_str!("move_nodes.wgsl"), &[ReadWrite, Read, ReadWrite]);

/// Reads `transforms`, moves `rows`, adds to `travelled`.
pub(super) fn bind(
    gpu: &Gpu,
    rows: &GpuBuffer<Bits>,
    transforms: &GpuBuffer<Row>,
    travelled: &GpuBuffer<Row>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[rows, transforms, travelled])
}
