//! Wrapper of `compare_depth.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "compare_depth",
    include_str!("compare_depth.wgsl"),
    &[Uniform, Uniform, Uniform, Read, Read, Read, Read, ReadWrite],
);

/// Reads depth, index map and surfels, adds to the results.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    let FrameBuffers { observation, store, .. } = frame;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &frame.view,
            &frame.settings,
            &frame.index_scale,
            &observation.depth,
            &frame.index_map.slots,
            &store.geometry,
            &store.orientation,
            &frame.results,
        ],
    )
}
