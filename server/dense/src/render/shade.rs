//! Wrapper of `shade.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::Coloring;
use crate::store::SurfelStore;
use crate::view::GpuView;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "shade",
    include_str!("shade.wgsl"),
    &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// `ShadeSettings` of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ShadeSettings {
    /// Packed colour where nothing is.
    background: u32,
    coloring: u32,
    weight_max: f32,
    padding: u32,
}

impl ShadeSettings {
    pub fn new([red, green, blue]: [u8; 3], coloring: Coloring, weight_max: f32) -> Self {
        let background = u32::from_le_bytes([red, green, blue, 0xFF]);
        Self { background, coloring: coloring as u32, weight_max, padding: 0 }
    }
}

/// Reads the index map `slots` and the surfels, writes (`pixels`, `depth`).
pub(super) fn bind(
    gpu: &Gpu,
    (view, settings): (&GpuBuffer<GpuView>, &GpuBuffer<ShadeSettings>),
    slots: &GpuBuffer<u32>,
    store: &SurfelStore,
    (pixels, depth): (&GpuBuffer<u32>, &GpuBuffer<f32>),
) -> Result<BoundKernel, GpuError> {
    let SurfelStore { geometry, orientation, appearance, .. } = store;
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[view, settings, slots, geometry, orientation, appearance, pixels, depth])
}
