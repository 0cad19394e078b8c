//! Wrapper of `take_templates.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{FlowParts, FlowSettings};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "take_templates",
    concat!(include_str!("take_templates.wgsl"), include_str!("flow.wgsl")),
    &[Uniform, Read, Read, Read, ReadWrite],
);

/// Sample distances.
const SPREADS: usize = 3;

/// Samples of a patch, at all distances.
pub(super) fn samples(radius: u32) -> usize {
    SPREADS * (2 * radius as usize + 1).pow(2)
}

/// Reads this frame's picture and depth, writes the templates of its patches.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<FlowSettings>,
    parts: &FlowParts,
) -> Result<BoundKernel, GpuError> {
    let FlowParts { refined, observation, keyframe, .. } = *parts;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[settings, refined, &observation.depth, &observation.grey, &keyframe.templates])
}
