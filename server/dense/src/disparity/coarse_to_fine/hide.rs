//! Wrapper of `hide.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::DisparityRange;
use crate::disparity::band::Band;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "hide",
    concat!(include_str!("hide.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Uniform, Read, ReadWrite, ReadWrite],
);

/// `Hiding` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Hiding {
    pub tolerance: f32,
    pub disparity_min: f32,
    pub disparity_max: f32,
    padding: f32,
}

impl Hiding {
    /// Accepts the disparities of `range`, and surfaces behind others by less than `tolerance_px`.
    pub fn new(range: DisparityRange, tolerance_px: f64) -> Self {
        let disparity_min = range.min_px as f32;
        let disparity_max = disparity_min + range.count() as f32;
        Self { tolerance: tolerance_px as f32, disparity_min, disparity_max, padding: 0.0 }
    }
}

/// Changes the planes in place; `nearest` holds one value per pixel.
pub(super) fn bind(
    gpu: &Gpu,
    whole: &GpuBuffer<Band>,
    hiding: &Hiding,
    masked: &GpuBuffer<u32>,
    (nearest, planes): (&GpuBuffer<f32>, &GpuBuffer<[f32; 4]>),
) -> Result<BoundKernel, GpuError> {
    let hiding = gpu.uniform("hiding", hiding)?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[whole, &hiding, masked, nearest, planes])
}
