//! Wrapper of `claim_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::NodeStore;
use crate::store::SurfelStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "claim_nodes",
    include_str!("claim_nodes.wgsl"),
    &[Uniform, Read, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads nodes and surfels, writes (`held`, `claims`).
pub(super) fn bind(gpu: &Gpu, nodes: &NodeStore, surfels: &SurfelStore) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &nodes.settings,
            &nodes.rows,
            &nodes.hash.heads,
            &nodes.hash.next,
            &surfels.geometry,
            &surfels.history,
            &nodes.held,
            &nodes.claims,
        ],
    )
}
