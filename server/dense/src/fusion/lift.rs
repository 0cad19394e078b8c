//! Wrapper of `lift.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "lift",
    include_str!("lift.wgsl"),
    &[
        Uniform, Uniform, Uniform, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite,
        ReadWrite,
    ],
);

/// Reads the observation, appends surfels.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    let FrameBuffers { observation, store, .. } = frame;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &frame.view,
            &frame.settings,
            &frame.tone,
            &observation.depth,
            &observation.sigma_z,
            &observation.normal,
            &observation.color,
            &frame.lifted.flags,
            &frame.lifted.offsets,
            &store.geometry,
            &store.orientation,
            &store.appearance,
            &store.history,
        ],
    )
}
