//! Wrapper of `follow_patches.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{FlowParts, FlowSettings};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "follow_patches",
    concat!(include_str!("follow_patches.wgsl"), include_str!("flow.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite],
);

/// Reads the keyframe and this picture, writes the first rows of the matches.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<FlowSettings>,
    parts: &FlowParts,
) -> Result<BoundKernel, GpuError> {
    let keyframe = parts.keyframe;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            settings,
            parts.view,
            &keyframe.depth,
            &keyframe.templates,
            &parts.observation.grey,
            &keyframe.tissue.rows,
            parts.matches,
        ],
    )
}
