//! Wrapper of `sobel.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;
use crate::preprocess::Preprocess;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("sobel", elas_text!("sobel.wgsl"), &[Uniform, Read, Read, ReadWrite]);

/// Reads both eyes' grey values, writes their Sobel responses.
pub(super) fn bind(
    gpu: &Gpu,
    images: &Images,
    input: &Preprocess,
    buffers: &Buffers,
) -> Result<BoundKernel, GpuError> {
    let [left, right] = [&input.left().luma, &input.right().luma];
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, left, right, &buffers.responses])
}
