//! Wrapper of `compare_published.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum};

use super::settings::PublishSettings;
use crate::store::SurfelStore;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "compare_published",
    concat!(include_str!("compare_published.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Read, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the surfels and the published copy, writes the flags `changed` and the largest difference left.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<PublishSettings>,
    store: &SurfelStore,
    (changed, worst): (&PrefixSum, &GpuBuffer<u32>),
) -> Result<BoundKernel, GpuError> {
    let SurfelStore { geometry, orientation, appearance, history, held, .. } = store;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            settings,
            geometry,
            orientation,
            appearance,
            history,
            &held.geometry,
            &held.orientation,
            &held.rest,
            &changed.flags,
            worst,
        ],
    )
}
