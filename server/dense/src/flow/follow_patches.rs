//! Wrapper of `follow_patches.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{FlowParts, FlowSettings};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "follow_patches",
    include_str!("follow_patches.wgsl"),
    &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite],
);

/// Reads the last picture and this one, writes the first rows of the matches.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<FlowSettings>,
    parts: &FlowParts,
) -> Result<BoundKernel, GpuError> {
    let before = parts.before;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[settings, parts.view, &before.view, &before.depth, &before.grey, parts.grey, &before.matches],
    )
}
