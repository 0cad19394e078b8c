//! Wrapper of the four speckle kernels: connected components of the disparity image, the small ones removed.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration, Stage};

use super::band::Band;
use super::buffers::Images;
use super::config::FilterConfig;

macro_rules! speckle_text {
    ($file:literal) => {
        concat!(include_str!($file), include_str!("speckle.wgsl"), include_str!("common.wgsl"))
    };
}

pub(super) const DECLARATIONS: [KernelDeclaration; 4] = [
    KernelDeclaration::new(
        "label_runs",
        speckle_text!("label_runs.wgsl"),
        &[Uniform, Uniform, Read, ReadWrite, ReadWrite, ReadWrite],
    ),
    KernelDeclaration::new(
        "join_runs",
        speckle_text!("join_runs.wgsl"),
        &[Uniform, Uniform, Read, Read, ReadWrite],
    ),
    KernelDeclaration::new(
        "measure_segments",
        concat!(include_str!("measure_segments.wgsl"), include_str!("common.wgsl")),
        &[Uniform, Read, Read, ReadWrite],
    ),
    KernelDeclaration::new(
        "drop_speckles",
        speckle_text!("drop_speckles.wgsl"),
        &[Uniform, Uniform, Read, Read, ReadWrite],
    ),
];

/// `Speckle` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Speckle {
    step_max: f32,
    area_min: u32,
    padding: [u32; 2],
}

/// The four kernels, bound to the filtered disparity image, which they change in place.
#[derive(Debug)]
pub(super) struct SpeckleFilter {
    kernels: [BoundKernel; 4],
}

impl SpeckleFilter {
    pub fn new(gpu: &Gpu, images: &Images, config: &FilterConfig) -> Result<Self, GpuError> {
        let speckle = gpu.uniform(
            "speckle",
            &Speckle {
                step_max: config.speckle_step_px as f32,
                area_min: config.speckle_area_px,
                padding: [0; 2],
            },
        )?;
        let pixels = 4 * images.filtered.len();
        let labels: GpuBuffer<u32> = gpu.storage("speckle labels", pixels)?;
        let runs: GpuBuffer<u32> = gpu.storage("speckle runs", pixels)?;
        let areas: GpuBuffer<u32> = gpu.storage("speckle areas", pixels)?;
        let Images { whole, filtered, .. } = images;
        let [label, join, measure, drop] = &DECLARATIONS;
        Ok(Self {
            kernels: [
                gpu.kernel(label)?.bind(gpu, &[whole, &speckle, filtered, &labels, &runs, &areas])?,
                gpu.kernel(join)?.bind(gpu, &[whole, &speckle, filtered, &runs, &labels])?,
                gpu.kernel(measure)?.bind(gpu, &[whole, &labels, &runs, &areas])?,
                gpu.kernel(drop)?.bind(gpu, &[whole, &speckle, &labels, &areas, filtered])?,
            ],
        })
    }

    pub fn record(&self, stage: &mut Stage, whole: &Band) -> Result<(), GpuError> {
        let [label, join, measure, drop] = &self.kernels;
        stage.run(label, [whole.height, 1, 1])?;
        stage.run(join, [whole.width, whole.height, 1])?;
        stage.run(measure, [whole.width, whole.height, 1])?;
        stage.run(drop, [whole.words, whole.height, 1])
    }
}
