//! Wrapper of `thin_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::NodeStore;
use crate::store::SurfelStore;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("thin_nodes", include_str!("thin_nodes.wgsl"), &[Uniform, Read, Read, ReadWrite]);

/// Reads the claims, writes `chosen`.
pub(super) fn bind(gpu: &Gpu, nodes: &NodeStore, surfels: &SurfelStore) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&nodes.settings, &surfels.geometry, &nodes.claims, &nodes.chosen])
}
