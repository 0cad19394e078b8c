//! Wrapper of `band_winner.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::buffers::{Images, Volumes};
use crate::disparity::{SgmConfig, SpreadConfig};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "band_winner",
    concat!(include_str!("band_winner.wgsl"), include_str!("band.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// `Choice` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Choice {
    volumes: u32,
    curvature_sigma: f32,
    paths: f32,
    small_penalties: f32,
    penalty_share: f32,
    padding: [u32; 3],
}

impl Choice {
    pub fn new(sgm: &SgmConfig, spread: &SpreadConfig) -> Self {
        Self {
            volumes: sgm.paths / 2,
            curvature_sigma: spread.curvature_px as f32,
            paths: sgm.paths as f32,
            small_penalties: (sgm.paths * sgm.small_penalty) as f32,
            penalty_share: sgm.subpixel_penalty_share as f32,
            padding: [0; 3],
        }
    }
}

/// Reads the summed paths, writes the matched disparities and their spreads.
pub(super) fn bind(
    gpu: &Gpu,
    choice: &Choice,
    images: &Images,
    prior: &GpuBuffer<[f32; 4]>,
    volumes: &Volumes,
) -> Result<BoundKernel, GpuError> {
    let choice = gpu.uniform("choice", choice)?;
    let [a, b, c, d] = volumes.four_sums();
    let Images { whole, descriptors, matched, spreads, .. } = images;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[whole, &choice, &descriptors[0], prior, a, b, c, d, matched, spreads])
}
