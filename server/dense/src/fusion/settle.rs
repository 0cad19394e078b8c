//! Wrapper of `settle.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "settle",
    include_str!("settle.wgsl"),
    &[Uniform, Read, Read, Read, ReadWrite, ReadWrite, Read],
);

/// Reads the claims, updates the states, counts.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    let store = &frame.store;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &frame.settings,
            &store.geometry,
            &store.orientation,
            &frame.claims,
            &store.history,
            &frame.results,
            &frame.index_map.visible.slots,
        ],
    )
}
