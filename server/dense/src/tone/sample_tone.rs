//! Wrapper of `sample_tone.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;
use crate::store::Row;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "sample_tone",
    include_str!("sample_tone.wgsl"),
    &[Uniform, Uniform, Uniform, Read, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads observation, index map and surfels, writes `sums`.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers, sums: &GpuBuffer<Row>) -> Result<BoundKernel, GpuError> {
    let FrameBuffers { observation, store, .. } = frame;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &frame.view,
            &frame.settings,
            &frame.index_scale,
            &observation.depth,
            &observation.normal,
            &observation.color,
            &frame.index_map.slots,
            &store.geometry,
            &store.appearance,
            sums,
        ],
    )
}
