//! Disparity of each frame, inside the frame's submission.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, KernelDeclaration};

use super::aggregate::{self, Walk};
use super::band::{Band, bands, rows_at_once, volume_count};
use super::buffers::{Images, Volumes};
use super::config::{DisparityConfig, Method};
use super::cross_check::{self, Acceptance};
use super::fit_plane::{self, PlaneFit};
use super::range::DisparityRange;
use super::speckle::{self, SpeckleFilter};
use super::{census, matching_cost, median, winner};
use crate::DenseError;
use crate::preprocess::{EyeBuffers, Preprocess};

/// Finds the disparity of the pair that [`Preprocess`] prepared.
#[derive(Debug)]
pub struct DisparityStage {
    whole: Band,
    images: Images,
    census: [BoundKernel; 2],
    bands: Vec<BandKernels>,
    median: BoundKernel,
    speckle: SpeckleFilter,
    fit_plane: BoundKernel,
}

/// The kernels of one band.
#[derive(Debug)]
struct BandKernels {
    band: Band,
    matching_cost: BoundKernel,
    paths: Vec<BoundKernel>,
    winner: BoundKernel,
    cross_check: BoundKernel,
}

impl DisparityStage {
    /// Compiles the kernels for images of `input`'s size and makes their buffers.
    ///
    /// # Errors
    /// [`DenseError::Config`], and whatever the GPU refuses.
    pub fn new(
        gpu: &Gpu,
        input: &Preprocess,
        range: DisparityRange,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        config.check()?;
        match config.method {
            Method::Sgm => Self::semi_global(gpu, input, range, config),
        }
    }

    fn semi_global(
        gpu: &Gpu,
        input: &Preprocess,
        range: DisparityRange,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let whole = Band::whole(input.size(), range);
        let images = Images::new(gpu, &whole)?;
        let bands = bands(whole, rows_at_once(gpu, &whole, config), config.band_margin_px)?;
        let pixels = bands.iter().map(Band::pixels).fold(0, usize::max);
        let volumes = Volumes::new(gpu, pixels, range.groups, volume_count(&config.sgm))?;
        let bands = bands
            .into_iter()
            .map(|band| BandKernels::new(gpu, band, config, &images, (input.left(), &volumes)))
            .collect::<Result<_, _>>()?;
        let [left, right] = &images.descriptors;
        Ok(Self {
            census: [
                census::bind(gpu, &images.whole, input.left(), left)?,
                census::bind(gpu, &images.whole, input.right(), right)?,
            ],
            bands,
            median: median::bind(gpu, &images)?,
            speckle: SpeckleFilter::new(gpu, &images, &config.filter)?,
            fit_plane: fit_plane::bind(gpu, &images, input.left(), &PlaneFit::new(config))?,
            images,
            whole,
        })
    }

    /// Records the disparity of the prepared pair.
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let words = [self.whole.words, self.whole.height, 1];
        frame.stage("census", |stage| self.census.iter().try_for_each(|kernel| stage.run(kernel, words)))?;
        for band in &self.bands {
            band.record(frame)?;
        }
        frame.stage("disparity filter", |stage| {
            stage.run(&self.median, words)?;
            self.speckle.record(stage, &self.whole)?;
            stage.run(&self.fit_plane, words)
        })?;
        Ok(())
    }

    /// The result, one element per pixel in row order: disparity (px, below -1e5 where unknown), its slopes along x
    /// and y (px per px), its standard deviation (px).
    pub fn planes(&self) -> &GpuBuffer<[f32; 4]> {
        &self.images.planes
    }

    /// Bands that the image is matched in.
    pub fn band_count(&self) -> usize {
        self.bands.len()
    }
}

impl BandKernels {
    fn new(
        gpu: &Gpu,
        band: Band,
        config: &DisparityConfig,
        images: &Images,
        (left, volumes): (&EyeBuffers, &Volumes),
    ) -> Result<Self, DenseError> {
        let sgm = &config.sgm;
        let uniform = gpu.uniform("band", &band)?;
        let path = |index: usize| {
            let walk = Walk::new(index, sgm);
            aggregate::bind(gpu, &uniform, &walk, (band.groups, index / 2), (left, volumes))
        };
        Ok(Self {
            matching_cost: matching_cost::bind(gpu, &uniform, sgm.silent_cost, images, volumes)?,
            paths: (0..sgm.paths as usize).map(path).collect::<Result<_, _>>()?,
            winner: winner::bind(gpu, &uniform, band.groups, volumes)?,
            cross_check: cross_check::bind(gpu, &uniform, &Acceptance::new(config), images, volumes)?,
            band,
        })
    }

    fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let Band { width, words, rows, keep_rows, .. } = self.band;
        frame.stage("matching cost", |stage| stage.run(&self.matching_cost, [words, rows, 1]))?;
        frame.stage("cost aggregation", |stage| {
            let lines = |index: usize| if aggregate::STEPS[index].1 == 0 { rows } else { width };
            let mut paths = self.paths.iter().enumerate();
            paths.try_for_each(|(index, path)| stage.run(path, [lines(index), 1, 1]))
        })?;
        frame.stage("winner takes all", |stage| {
            stage.run(&self.winner, [rows, 1, 1])?;
            stage.run(&self.cross_check, [words, keep_rows, 1])
        })?;
        Ok(())
    }
}

/// The declarations of all disparity kernels, unrolled ones for one group of disparities.
pub(crate) fn kernels() -> Vec<KernelDeclaration> {
    let mut all = vec![
        census::DECLARATION,
        matching_cost::DECLARATION,
        aggregate::declaration(1),
        winner::declaration(1),
        cross_check::DECLARATION,
        median::DECLARATION,
        fit_plane::DECLARATION,
    ];
    all.extend(speckle::DECLARATIONS);
    all
}
