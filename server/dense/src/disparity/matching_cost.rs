//! Wrapper of `matching_cost.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::band::Band;
use super::buffers::{Images, Volumes};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "matching_cost",
    concat!(include_str!("matching_cost.wgsl"), include_str!("common.wgsl")),
    &[Uniform, Uniform, Read, Read, ReadWrite],
);

/// `Matching` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Matching {
    silent_cost: u32,
    padding: [u32; 3],
}

impl Matching {
    pub fn new(silent_cost: u32) -> Self {
        Self { silent_cost, padding: [0; 3] }
    }
}

/// Reads both eyes' descriptors, writes the costs of a band.
pub(super) fn bind(
    gpu: &Gpu,
    band: &GpuBuffer<Band>,
    silent_cost: u32,
    images: &Images,
    volumes: &Volumes,
) -> Result<BoundKernel, GpuError> {
    let matching = gpu.uniform("matching", &Matching::new(silent_cost))?;
    let [left, right] = &images.descriptors;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[band, &matching, left, right, &volumes.costs])
}
