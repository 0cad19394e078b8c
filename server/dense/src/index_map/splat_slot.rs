//! Wrapper of `splat_slot.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{SplatSettings, VisibleSurfels};
use crate::store::Bits;
use crate::view::GpuView;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "splat_slot",
    concat!(include_str!("splat_slot.wgsl"), include_str!("settings.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, ReadWrite],
);

/// Reads the `visible` surfels, their `footprints` and `nearest`, writes `slots`.
pub(super) fn bind(
    gpu: &Gpu,
    (view, settings): (&GpuBuffer<GpuView>, &GpuBuffer<SplatSettings>),
    (visible, footprints): (&VisibleSurfels, &GpuBuffer<Bits>),
    (nearest, slots): (&GpuBuffer<u32>, &GpuBuffer<u32>),
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[view, settings, &visible.slots, footprints, nearest, slots])
}
