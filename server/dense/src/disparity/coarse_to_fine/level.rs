//! A level finer than the searched one: a narrow band about the prior is matched, then patches are refined.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer};

use super::band_winner::Choice;
use super::refinement::{Refinement, Views};
use super::search::at_level;
use super::{band_cost, band_winner, descend};
use crate::DenseError;
use crate::disparity::aggregate::{self, STEPS, Walk};
use crate::disparity::band::Band;
use crate::disparity::buffers::{Images, Volumes};
use crate::disparity::fit_plane::{self, PlaneFit};
use crate::disparity::speckle::SpeckleFilter;
use crate::disparity::{DisparityConfig, SgmConfig, census, median};
use crate::preprocess::Eyes;

#[derive(Debug)]
pub(super) struct FinerLevel {
    whole: Band,
    planes: GpuBuffer<[f32; 4]>,
    descend: BoundKernel,
    band: Option<BandMatch>,
    refinement: Refinement,
}

/// Matching of 16 disparities about the prior, from descriptors to planes.
#[derive(Debug)]
struct BandMatch {
    whole: Band,
    census: [BoundKernel; 2],
    cost: BoundKernel,
    paths: Vec<BoundKernel>,
    winner: BoundKernel,
    median: BoundKernel,
    speckle: SpeckleFilter,
    fit_plane: BoundKernel,
}

impl FinerLevel {
    /// Level `index` below the `coarse` planes of a size.
    pub fn new(
        gpu: &Gpu,
        (eyes, views): (Eyes, Views),
        (whole, index): (Band, u32),
        (coarse_size, coarse): ((u32, u32), &GpuBuffer<[f32; 4]>),
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let uniform = gpu.uniform("level", &whole)?;
        let planes = gpu.storage("disparity planes", whole.pixels())?;
        let is_matched = index >= config.narrow.finest_level;
        let band =
            is_matched.then(|| BandMatch::new(gpu, eyes, (whole, index), &planes, config)).transpose()?;
        // the image itself has already shown all it can at the level above
        let rounds = if is_matched { config.patch.finer_rounds } else { 0 };
        Ok(Self {
            descend: descend::bind(gpu, &uniform, coarse_size, coarse, &planes)?,
            refinement: Refinement::new(gpu, views, &whole, &planes, rounds, config)?,
            band,
            planes,
            whole,
        })
    }

    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let Band { width, height, .. } = self.whole;
        frame.stage("patch refinement", |stage| stage.run(&self.descend, [width, height, 1]))?;
        if let Some(band) = &self.band {
            band.record(frame)?;
        }
        self.refinement.record(frame)?;
        Ok(())
    }

    pub fn planes(&self) -> &GpuBuffer<[f32; 4]> {
        &self.planes
    }
}

impl BandMatch {
    /// `planes` hold the prior, and then the result.
    fn new(
        gpu: &Gpu,
        eyes: Eyes,
        (whole, index): (Band, u32),
        planes: &GpuBuffer<[f32; 4]>,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let sgm = narrow_penalties(config);
        let filter = at_level(&config.filter, index);
        let images = Images { planes: planes.clone(), ..Images::new(gpu, &whole)? };
        let volumes = Volumes::new(gpu, whole.pixels(), whole.groups, sgm.paths / 2)?;
        let path = |path: usize| {
            let walk = Walk::new(path, &sgm);
            aggregate::bind(gpu, &images.whole, &walk, (whole.groups, path / 2), (eyes.left, &volumes))
        };
        let [left, right] = &images.descriptors;
        let choice = Choice::new(&sgm, &config.spread);
        let fit = PlaneFit::new(&DisparityConfig { filter: filter.clone(), ..config.clone() });
        let fit = fit.about_prior(config.narrow.gate_px, config.narrow.hole_gate_px);
        Ok(Self {
            census: [
                census::bind(gpu, &images.whole, eyes.left, left)?,
                census::bind(gpu, &images.whole, eyes.right, right)?,
            ],
            cost: band_cost::bind(gpu, sgm.silent_cost, &images, planes, &volumes)?,
            paths: (0..sgm.paths as usize).map(path).collect::<Result<_, _>>()?,
            winner: band_winner::bind(gpu, &choice, &images, planes, &volumes)?,
            median: median::bind(gpu, &images)?,
            speckle: SpeckleFilter::new(gpu, &images, &filter)?,
            fit_plane: fit_plane::bind(gpu, &images, eyes.left, &fit)?,
            whole,
        })
    }

    fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let Band { width, height, words, .. } = self.whole;
        let of_words = [words, height, 1];
        frame
            .stage("census", |stage| self.census.iter().try_for_each(|kernel| stage.run(kernel, of_words)))?;
        frame.stage("matching cost", |stage| stage.run(&self.cost, [width, height, 1]))?;
        frame.stage("cost aggregation", |stage| {
            self.paths.iter().zip(STEPS).try_for_each(|(path, (_, step_y))| {
                stage.run(path, [if step_y == 0 { height } else { width }, 1, 1])
            })
        })?;
        frame.stage("winner takes all", |stage| stage.run(&self.winner, of_words))?;
        frame.stage("disparity filter", |stage| {
            stage.run(&self.median, of_words)?;
            self.speckle.record(stage, &self.whole)?;
            stage.run(&self.fit_plane, of_words)
        })?;
        Ok(())
    }
}

/// The penalties along a narrow band: steps are deviations from the prior's surface.
fn narrow_penalties(config: &DisparityConfig) -> SgmConfig {
    let narrow = &config.narrow;
    SgmConfig {
        small_penalty: narrow.small_penalty,
        jump_penalty_max: narrow.jump_penalty_max,
        jump_penalty_min: narrow.jump_penalty_min,
        jump_penalty_per_level: narrow.jump_penalty_per_level,
        ..config.sgm.clone()
    }
}
