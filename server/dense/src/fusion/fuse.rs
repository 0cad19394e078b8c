//! Wrapper of `fuse.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "fuse",
    include_str!("fuse.wgsl"),
    &[
        Uniform, Uniform, Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite,
        ReadWrite, Read,
    ],
);

/// Reads the observation and the verdict, updates the surfels.
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
            &frame.results,
            &store.geometry,
            &store.orientation,
            &store.appearance,
            &store.history,
            &frame.index_map.visible.slots,
        ],
    )
}
