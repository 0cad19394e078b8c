//! Wrapper of `hash_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{GraphSettings, NodeHash};
use crate::store::Bits;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "hash_nodes",
    include_str!("hash_nodes.wgsl"),
    &[Uniform, Read, ReadWrite, ReadWrite],
);

/// Reads the rows of nodes, writes `hash`.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<GraphSettings>,
    rows: &GpuBuffer<Bits>,
    hash: &NodeHash,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[settings, rows, &hash.heads, &hash.next])
}
