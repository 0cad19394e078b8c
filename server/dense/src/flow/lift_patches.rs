//! Wrapper of `lift_patches.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{FlowParts, FlowSettings};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "lift_patches",
    concat!(include_str!("lift_patches.wgsl"), include_str!("flow.wgsl")),
    &[Uniform, Read, Read, ReadWrite],
);

/// Reads this frame's depth and corrected view, writes the tissue of the patches.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<FlowSettings>,
    parts: &FlowParts,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[settings, parts.refined, &parts.observation.depth, &parts.keyframe.tissue.rows])
}
