//! Matching by census and semi-global aggregation: from the prepared pair to filtered disparities and their spreads.

use gpu::{BoundKernel, FrameRecorder, Gpu};

use super::aggregate::{self, Walk};
use super::band::{Band, bands, rows_at_once, volume_count};
use super::buffers::{Images, Volumes};
use super::config::DisparityConfig;
use super::cross_check::{self, Acceptance};
use super::speckle::SpeckleFilter;
use super::{census, matching_cost, median, winner};
use crate::DenseError;
use crate::preprocess::{EyeBuffers, Eyes};

/// The kernels of semi-global matching, bound to the images of a stage.
#[derive(Debug)]
pub(super) struct SemiGlobal {
    whole: Band,
    census: [BoundKernel; 2],
    bands: Vec<BandKernels>,
    median: BoundKernel,
    speckle: SpeckleFilter,
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

impl SemiGlobal {
    pub fn new(
        gpu: &Gpu,
        eyes: Eyes,
        whole: Band,
        images: &Images,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let bands = bands(whole, rows_at_once(gpu, &whole, config), config.band_margin_px)?;
        let pixels = bands.iter().map(Band::pixels).fold(0, usize::max);
        let volumes = Volumes::new(gpu, pixels, whole.groups, volume_count(&config.sgm))?;
        let bands = bands
            .into_iter()
            .map(|band| BandKernels::new(gpu, band, config, images, (eyes.left, &volumes)))
            .collect::<Result<_, _>>()?;
        let [left, right] = &images.descriptors;
        Ok(Self {
            whole,
            census: [
                census::bind(gpu, &images.whole, eyes.left, left)?,
                census::bind(gpu, &images.whole, eyes.right, right)?,
            ],
            bands,
            median: median::bind(gpu, images)?,
            speckle: SpeckleFilter::new(gpu, images, &config.filter)?,
        })
    }

    /// Records the matching of the prepared pair.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let words = [self.whole.words, self.whole.height, 1];
        frame.stage("census", |stage| self.census.iter().try_for_each(|kernel| stage.run(kernel, words)))?;
        for band in &self.bands {
            band.record(frame)?;
        }
        frame.stage("disparity filter", |stage| {
            stage.run(&self.median, words)?;
            self.speckle.record(stage, &self.whole)
        })?;
        Ok(())
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
