//! Wrapper of `claim_surfels.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "claim_surfels",
    include_str!("claim_surfels.wgsl"),
    &[Uniform, Uniform, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite, Read],
);

/// Reads the surfels, writes the covered pixels and the claims.
pub(super) fn bind(gpu: &Gpu, frame: &FrameBuffers) -> Result<BoundKernel, GpuError> {
    let FrameBuffers { observation, store, .. } = frame;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &frame.view,
            &frame.settings,
            &observation.depth,
            &observation.sigma_z,
            &frame.results,
            &store.geometry,
            &store.orientation,
            &store.history,
            &frame.covered,
            &frame.claims,
            &frame.index_map.visible.slots,
        ],
    )
}
