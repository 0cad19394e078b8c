//! Wrapper of `splat_depth.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{SplatSettings, VisibleSurfels};
use crate::store::SurfelStore;
use crate::view::GpuView;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "splat_depth",
    concat!(include_str!("splat_depth.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the `visible` surfels, writes `nearest` and the footprints in the store's scratch.
pub(super) fn bind(
    gpu: &Gpu,
    (view, settings): (&GpuBuffer<GpuView>, &GpuBuffer<SplatSettings>),
    store: &SurfelStore,
    visible: &VisibleSurfels,
    nearest: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            view,
            settings,
            &store.geometry,
            &store.orientation,
            &store.history,
            &visible.slots,
            nearest,
            &store.scratch,
        ],
    )
}
