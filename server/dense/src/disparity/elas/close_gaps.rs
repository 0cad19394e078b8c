//! Wrapper of `close_gaps.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::buffers::Images;
use crate::preprocess::EyeBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "close_gaps",
    elas_text!("close_gaps.wgsl"),
    &[Uniform, Uniform, Read, Read, ReadWrite, ReadWrite],
);

/// `Gaps` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Gaps {
    pub width_max: u32,
    pub along_columns: u32,
    pub padding: [u32; 2],
}

/// Reads `source`, writes `filled`, both disparity images, and the spreads of what it fills.
pub(super) fn bind(
    gpu: &Gpu,
    gaps: &Gaps,
    images: &Images,
    left: &EyeBuffers,
    [source, filled]: [&GpuBuffer<[f32; 4]>; 2],
) -> Result<BoundKernel, GpuError> {
    let gaps = gpu.uniform("gaps", gaps)?;
    let Images { whole, spreads, .. } = images;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &gaps, &left.masked, source, filled, spreads])
}
