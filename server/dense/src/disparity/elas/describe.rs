//! Wrapper of `describe.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use crate::disparity::buffers::Images;
use crate::preprocess::Preprocess;

pub(super) const DECLARATION: KernelDeclaration =
    KernelDeclaration::new("describe", elas_text!("describe.wgsl"), &[Uniform, Read, Read, Read, ReadWrite]);

/// Reads the Sobel responses and the masks, writes the descriptors of both views.
pub(super) fn bind(
    gpu: &Gpu,
    images: &Images,
    input: &Preprocess,
    buffers: &Buffers,
) -> Result<BoundKernel, GpuError> {
    let [left, right] = [&input.left().masked, &input.right().masked];
    let Buffers { responses, descriptors, .. } = buffers;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, responses, left, right, descriptors])
}
