//! Wrapper of `date_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::node_graph::NodeStore;
use crate::store::SurfelStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "date_nodes",
    include_str!("date_nodes.wgsl"),
    &[Uniform, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads nodes and surfels, writes `dates`, which must be zero before.
pub(super) fn bind(
    gpu: &Gpu,
    nodes: &NodeStore,
    surfels: &SurfelStore,
    dates: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    let NodeStore { settings, rows, hash, .. } = nodes;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[settings, rows, &hash.heads, &hash.next, &surfels.geometry, &surfels.history, dates])
}
