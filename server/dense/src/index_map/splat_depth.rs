//! Wrapper of `splat_depth.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::SplatSettings;
use crate::store::{Bits, SurfelStore};
use crate::view::GpuView;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "splat_depth",
    concat!(include_str!("splat_depth.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the surfels, writes (`nearest`, `footprints`).
pub(super) fn bind(
    gpu: &Gpu,
    view: &GpuBuffer<GpuView>,
    settings: &GpuBuffer<SplatSettings>,
    store: &SurfelStore,
    (nearest, footprints): (&GpuBuffer<u32>, &GpuBuffer<Bits>),
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[view, settings, &store.geometry, &store.orientation, &store.history, nearest, footprints],
    )
}
