//! Wrapper of `shade.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::store::SurfelStore;
use crate::view::GpuView;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "shade",
    include_str!("shade.wgsl"),
    &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the index map `slots` and the surfels, writes (`pixels`, `depth`).
pub(super) fn bind(
    gpu: &Gpu,
    (view, background): (&GpuBuffer<GpuView>, &GpuBuffer<u32>),
    slots: &GpuBuffer<u32>,
    store: &SurfelStore,
    (pixels, depth): (&GpuBuffer<u32>, &GpuBuffer<f32>),
) -> Result<BoundKernel, GpuError> {
    let SurfelStore { geometry, orientation, appearance, .. } = store;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[view, background, slots, geometry, orientation, appearance, pixels, depth])
}
