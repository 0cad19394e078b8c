//! Wrapper of `list_visible.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::SplatSettings;
use crate::store::{Row, SurfelStore};
use crate::view::GpuView;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "list_visible",
    concat!(include_str!("list_visible.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Uniform, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads the surfels, deletes forgotten ones, writes (`masks`, `counts`, `spheres`) per chunk and adds to `results`.
pub(super) fn bind(
    gpu: &Gpu,
    (view, settings): (&GpuBuffer<GpuView>, &GpuBuffer<SplatSettings>),
    store: &SurfelStore,
    (masks, counts, spheres): (&GpuBuffer<u32>, &GpuBuffer<u32>, &GpuBuffer<Row>),
    results: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[view, settings, &store.geometry, &store.history, masks, counts, results, spheres])
}
