//! Wrapper of `claim_pixels.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "claim_pixels",
    include_str!("claim_pixels.wgsl"),
    &[Uniform, Uniform, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads the observation and the covered pixels, adds claims.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    let observation = &frame.observation;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &frame.view,
            &frame.settings,
            &observation.depth,
            &observation.sigma_z,
            &observation.normal,
            &frame.results,
            &frame.covered,
            &frame.claims,
        ],
    )
}
