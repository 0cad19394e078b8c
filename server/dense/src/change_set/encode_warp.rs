//! Wrapper of `encode_warp.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::held_nodes::HeldNodes;
use super::settings::PublishSettings;
use crate::node_graph::NodeStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "encode_warp",
    concat!(include_str!("encode_warp.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Read, Read, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads the model's nodes and those held, resets what they have travelled, writes the codes and what they decode to.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<PublishSettings>,
    nodes: &NodeStore,
    held: &HeldNodes,
) -> Result<BoundKernel, GpuError> {
    let buffers: [&dyn gpu::Bindable; 6] =
        [settings, &nodes.rows, &held.places, &nodes.travelled, &held.codes, &held.transforms];
    gpu.kernel(&DECLARATION)?.bind(gpu, &buffers)
}
