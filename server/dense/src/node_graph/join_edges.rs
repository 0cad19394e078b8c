//! Wrapper of `join_edges.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::NodeStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "join_edges",
    include_str!("join_edges.wgsl"),
    &[Read, Read, Read, Read, ReadWrite],
);

/// Reads `nearest` and the followers, writes `edges`.
pub(super) fn bind(gpu: &Gpu, nodes: &NodeStore) -> Result<BoundKernel, GpuError> {
    let NodeStore { rows, nearest, follower_counts, followers, edges, .. } = nodes;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[rows, nearest, follower_counts, followers, edges])
}
