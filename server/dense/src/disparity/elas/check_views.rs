//! Wrapper of `check_views.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "check_views",
    elas_text!("check_views.wgsl"),
    &[Uniform, Uniform, Read, ReadWrite, ReadWrite],
);

/// Reads the disparities of both views, writes those of the left one that the right one confirms.
pub(super) fn bind(
    gpu: &Gpu,
    images: &Images,
    buffers: &Buffers,
    checked: &GpuBuffer<[f32; 4]>,
) -> Result<BoundKernel, GpuError> {
    let Buffers { search, found, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, search, found, checked, &images.spreads])
}
