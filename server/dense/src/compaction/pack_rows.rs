//! Wrapper of `pack_rows.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum};

use crate::store::Bits;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "pack_rows",
    include_str!("pack_rows.wgsl"),
    &[Uniform, Read, Read, Read, ReadWrite],
);

/// Reads `rows`, writes `packed`.
pub(super) fn bind(
    gpu: &Gpu,
    slots: &GpuBuffer<u32>,
    kept: &PrefixSum,
    (rows, packed): (&GpuBuffer<Bits>, &GpuBuffer<Bits>),
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[slots, &kept.flags, &kept.offsets, rows, packed])
}
