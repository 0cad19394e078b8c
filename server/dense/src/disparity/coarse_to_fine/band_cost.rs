//! Wrapper of `band_cost.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::disparity::buffers::{Images, Volumes};
use crate::disparity::matching_cost::Matching;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "band_cost",
    concat!(include_str!("band_cost.wgsl"), include_str!("band.wgsl"), include_str!("../common.wgsl")),
    &[Uniform, Uniform, Read, Read, Read, ReadWrite],
);

/// Reads both eyes' descriptors and the prior planes, writes the costs about these.
pub(super) fn bind(
    gpu: &Gpu,
    silent_cost: u32,
    images: &Images,
    prior: &GpuBuffer<[f32; 4]>,
    volumes: &Volumes,
) -> Result<BoundKernel, GpuError> {
    let matching = gpu.uniform("matching", &Matching::new(silent_cost))?;
    let [left, right] = &images.descriptors;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&images.whole, &matching, left, right, prior, &volumes.costs])
}
