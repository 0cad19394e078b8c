//! Wrapper of `bend_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::Corrections;
use crate::node_graph::NodeStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "bend_nodes",
    include_str!("bend_nodes.wgsl"),
    &[Read, Read, Read, Uniform, Read, ReadWrite],
);

/// Reads nodes and `dates`, writes the nodes' transforms.
pub(super) fn bind(
    gpu: &Gpu,
    nodes: &NodeStore,
    dates: &GpuBuffer<u32>,
    corrections: &Corrections,
) -> Result<BoundKernel, GpuError> {
    let NodeStore { rows, nearest, transforms, .. } = nodes;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[rows, nearest, dates, &corrections.count, &corrections.rows, transforms])
}
