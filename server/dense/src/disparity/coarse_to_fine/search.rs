//! The coarsest level: all disparities are searched, and every pixel gets a surface to start from.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer};

use super::fill_holes::{self, STRIDES};
use super::refinement::{Refinement, Views};
use crate::DenseError;
use crate::disparity::band::Band;
use crate::disparity::buffers::Images;
use crate::disparity::fit_plane::{self, PlaneFit};
use crate::disparity::semi_global::SemiGlobal;
use crate::disparity::{DisparityConfig, FilterConfig};
use crate::preprocess::Eyes;

#[derive(Debug)]
pub(super) struct Search {
    whole: Band,
    images: Images,
    matcher: SemiGlobal,
    fit_plane: BoundKernel,
    /// None where no finer level needs a prior.
    fill: Vec<BoundKernel>,
    refinement: Refinement,
}

impl Search {
    pub fn new(
        gpu: &Gpu,
        (eyes, views): (Eyes, Views),
        whole: Band,
        level: u32,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let config = DisparityConfig { filter: at_level(&config.filter, level), ..config.clone() };
        let images = Images::new(gpu, &whole)?;
        let filled = gpu.storage("filled planes", whole.pixels())?;
        let strides = if level == 0 { &[][..] } else { &STRIDES[..] };
        let between = [&images.planes, &filled];
        let fill = strides.iter().enumerate().map(|(run, &stride)| {
            let (source, filled) = (between[run % 2], between[(run + 1) % 2]);
            fill_holes::bind(gpu, &images.whole, stride, source, filled)
        });
        Ok(Self {
            fill: fill.collect::<Result<_, _>>()?,
            matcher: SemiGlobal::new(gpu, eyes, whole, &images, &config)?,
            fit_plane: fit_plane::bind(gpu, &images, eyes.left, &PlaneFit::new(&config))?,
            refinement: Refinement::new(
                gpu,
                views,
                &whole,
                &images.planes,
                config.patch.coarse_rounds,
                &config,
            )?,
            whole,
            images,
        })
    }

    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        self.matcher.record(frame)?;
        let Band { width, height, words, .. } = self.whole;
        frame.stage("disparity filter", |stage| {
            stage.run(&self.fit_plane, [words, height, 1])?;
            self.fill.iter().try_for_each(|kernel| stage.run(kernel, [width, height, 1]))
        })?;
        self.refinement.record(frame)?;
        Ok(())
    }

    pub fn planes(&self) -> &GpuBuffer<[f32; 4]> {
        &self.images.planes
    }

    pub fn band_count(&self) -> usize {
        self.matcher.band_count()
    }
}

/// Areas shrink by four with each level.
pub(super) fn at_level(filter: &FilterConfig, level: u32) -> FilterConfig {
    FilterConfig { speckle_area_px: filter.speckle_area_px >> (2 * level), ..filter.clone() }
}
