//! Wrapper of `cross_check.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::band::{Band, volume_count};
use super::buffers::{Images, Volumes};
use super::config::DisparityConfig;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "cross_check",
    concat!(include_str!("cross_check.wgsl"), include_str!("common.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// `Acceptance` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Acceptance {
    pub uniqueness_percent: u32,
    pub difference_max: i32,
    pub curvature_sigma: f32,
    pub paths: f32,
    pub volumes: u32,
    pub small_penalties: f32,
    pub penalty_share: f32,
    padding: u32,
}

impl Acceptance {
    pub fn new(config: &DisparityConfig) -> Self {
        Self {
            uniqueness_percent: config.sgm.uniqueness_percent,
            difference_max: config.sgm.cross_check_px,
            curvature_sigma: config.spread.curvature_px as f32,
            paths: config.sgm.paths as f32,
            volumes: volume_count(&config.sgm),
            small_penalties: (config.sgm.paths * config.sgm.small_penalty) as f32,
            penalty_share: config.sgm.subpixel_penalty_share as f32,
            padding: 0,
        }
    }
}

/// Reads the winners of a band, writes the rows that it keeps of the disparity image.
pub(super) fn bind(
    gpu: &Gpu,
    band: &GpuBuffer<Band>,
    acceptance: &Acceptance,
    images: &Images,
    volumes: &Volumes,
) -> Result<BoundKernel, GpuError> {
    let acceptance = gpu.uniform("acceptance", acceptance)?;
    let [a, b, c, d] = volumes.four_sums();
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            band,
            &acceptance,
            &images.descriptors[0],
            &volumes.left_winners,
            &volumes.right_winners,
            a,
            b,
            c,
            d,
            &images.matched,
            &images.spreads,
        ],
    )
}
