//! Wrapper of `emit_changes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum};

use super::settings::PublishSettings;
use crate::store::{RecordRow, SurfelStore};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "emit_changes",
    concat!(include_str!("emit_changes.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads the surfels and `changed`, updates the published copy, writes `records`.
pub(super) fn bind(
    gpu: &Gpu,
    settings: &GpuBuffer<PublishSettings>,
    store: &SurfelStore,
    (changed, records): (&PrefixSum, &GpuBuffer<RecordRow>),
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
            &changed.flags,
            &changed.offsets,
            &held.geometry,
            &held.orientation,
            &held.rest,
            records,
        ],
    )
}
