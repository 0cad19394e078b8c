//! Wrapper of `follow_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::held_nodes::HeldNodes;
use super::settings::PublishSettings;
use crate::node_graph::NodeStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "follow_nodes",
    concat!(include_str!("follow_nodes.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the model's nodes and the codes, updates the nodes held.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<PublishSettings>,
    nodes: &NodeStore,
    held: &HeldNodes,
) -> Result<BoundKernel, GpuError> {
    let buffers: [&dyn gpu::Bindable; 5] = [settings, &nodes.rows, &held.codes, &held.places, &held.rows];
    gpu.kernel(&DECLARATION)?.bind(gpu, &buffers)
}
