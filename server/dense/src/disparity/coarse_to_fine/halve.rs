//! Wrapper of `halve.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use crate::preprocess::EyeBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "halve",
    concat!(include_str!("halve.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Read, Read, ReadWrite, ReadWrite, ReadWrite],
);

/// `Halving` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Halving {
    fine_width: u32,
    fine_height: u32,
    fine_words: u32,
    width: u32,
    height: u32,
    words: u32,
    padding: [u32; 2],
}

/// Columns and rows of the half size.
pub(super) fn halved((width, height): (u32, u32)) -> (u32, u32) {
    (width.div_ceil(2), height.div_ceil(2))
}

/// Reads an eye of `fine_size`, writes it in half the size.
pub(super) fn bind(
    gpu: &Gpu,
    fine_size: (u32, u32),
    fine: &EyeBuffers,
    eye: &EyeBuffers,
) -> Result<BoundKernel, GpuError> {
    let (width, height) = halved(fine_size);
    let halving = Halving {
        fine_width: fine_size.0,
        fine_height: fine_size.1,
        fine_words: fine_size.0.div_ceil(4),
        width,
        height,
        words: width.div_ceil(4),
        padding: [0; 2],
    };
    let halving = gpu.uniform("halving", &halving)?;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[&halving, &fine.grey, &fine.masked, &eye.grey, &eye.luma, &eye.masked])
}
