//! Wrapper of `place_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::NodeStore;
use crate::store::SurfelStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "place_nodes",
    include_str!("place_nodes.wgsl"),
    &[Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads `chosen`, adds and removes nodes.
pub(super) fn bind(gpu: &Gpu, nodes: &NodeStore, surfels: &SurfelStore) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &nodes.settings,
            &surfels.geometry,
            &nodes.chosen,
            &nodes.hash.heads,
            &nodes.hash.next,
            &nodes.rows,
            &nodes.transforms,
            &nodes.travelled,
            &nodes.held,
            &nodes.state,
            &nodes.free,
        ],
    )
}
