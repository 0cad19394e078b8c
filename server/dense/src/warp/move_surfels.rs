//! Wrapper of `move_surfels.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::WarpParts;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "move_surfels",
    include_str!("move_surfels.wgsl"),
    &[Uniform, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the warp and `stirred`, moves the surfels.
pub(super) fn bind(gpu: &Gpu, parts: &WarpParts, stirred: &GpuBuffer<u32>) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            parts.settings,
            parts.rows,
            &parts.hash.heads,
            &parts.hash.next,
            parts.transforms,
            stirred,
            parts.state,
            parts.geometry,
            parts.orientation,
        ],
    )
}
