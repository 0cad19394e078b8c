//! Wrapper of `link_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::NodeStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "link_nodes",
    include_str!("link_nodes.wgsl"),
    &[Uniform, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads the hashed nodes, writes `nearest` and the followers.
pub(super) fn bind(gpu: &Gpu, nodes: &NodeStore) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &nodes.settings,
            &nodes.rows,
            &nodes.hash.heads,
            &nodes.hash.next,
            &nodes.nearest,
            &nodes.follower_counts,
            &nodes.followers,
        ],
    )
}
