//! Wrapper of `prepare.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::upload::EyeBuffers;
use crate::disparity::DisparityConfig;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "prepare",
    include_str!("prepare.wgsl"),
    &[Uniform, Read, ReadWrite, ReadWrite, ReadWrite],
);

/// `Exposure` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Exposure {
    width: u32,
    height: u32,
    pub words: u32,
    saturated_level: u32,
    dark_level: u32,
    padding: [u32; 3],
}

impl Exposure {
    pub fn new((width, height): (u32, u32), config: &DisparityConfig) -> Self {
        Self {
            width,
            height,
            words: width.div_ceil(4),
            saturated_level: config.saturated_level,
            dark_level: config.dark_level,
            padding: [0; 3],
        }
    }
}

/// Reads one eye's colours, writes its grey values and mask.
pub(super) fn bind(
    gpu: &Gpu,
    exposure: &GpuBuffer<Exposure>,
    eye: &EyeBuffers,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[exposure, &eye.color, &eye.luma, &eye.masked, &eye.grey])
}
