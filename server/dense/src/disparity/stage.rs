//! Disparity of each frame, inside the frame's submission.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, KernelDeclaration};

use super::band::Band;
use super::buffers::Images;
use super::coarse_to_fine::{self, CoarseToFine, Refinement, Views};
use super::config::{DisparityConfig, Method, PatchConfig};
use super::elas::{self, Elas};
use super::fit_plane::{self, PlaneFit};
use super::range::DisparityRange;
use super::{aggregate, census, cross_check, matching_cost, median, speckle, winner};
use crate::DenseError;
use crate::preprocess::Preprocess;

/// Finds the disparity of the pair that [`Preprocess`] prepared.
#[derive(Debug)]
pub struct DisparityStage {
    matcher: Matcher,
}

#[derive(Debug)]
enum Matcher {
    Elas(Box<ElasPlanes>),
    CoarseToFine(Box<CoarseToFine>),
}

/// ELAS, and the planes that are fitted to its disparities and refined by inverse search, which it lacks.
#[derive(Debug)]
struct ElasPlanes {
    whole: Band,
    images: Images,
    elas: Elas,
    fit_plane: BoundKernel,
    refinement: Refinement,
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
        let matcher = match config.method {
            Method::Elas => Matcher::Elas(Box::new(ElasPlanes::new(gpu, input, range, config)?)),
            Method::Sgm => Matcher::CoarseToFine(Box::new(CoarseToFine::new(gpu, input, range, config)?)),
        };
        Ok(Self { matcher })
    }

    /// Records the disparity of the prepared pair.
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        match &self.matcher {
            Matcher::Elas(matcher) => matcher.record(frame),
            Matcher::CoarseToFine(matcher) => matcher.record(frame),
        }
    }

    /// The result, one element per pixel in row order: disparity (px, below -1e5 where unknown), its slopes along x
    /// and y (px per px), its standard deviation (px).
    pub fn planes(&self) -> &GpuBuffer<[f32; 4]> {
        match &self.matcher {
            Matcher::Elas(matcher) => &matcher.images.planes,
            Matcher::CoarseToFine(matcher) => matcher.planes(),
        }
    }

    /// Bands that the image is matched in.
    pub fn band_count(&self) -> usize {
        match &self.matcher {
            Matcher::Elas(_) => 1,
            Matcher::CoarseToFine(matcher) => matcher.band_count(),
        }
    }
}

impl ElasPlanes {
    fn new(
        gpu: &Gpu,
        input: &Preprocess,
        range: DisparityRange,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let whole = Band::whole(input.size(), range);
        let images = Images::new(gpu, &whole)?;
        let elas = Elas::new(gpu, input, whole, &images, config)?;
        let fit_plane = fit_plane::bind(gpu, &images, input.left(), &PlaneFit::new(config))?;
        let views = Views { eyes: input.eyes(), size: input.size(), cell: 1 };
        // coarser levels leave less for the last one to get wrong than a single level does
        let patch = PatchConfig { noise_levels: config.elas.patch_noise_levels, ..config.patch.clone() };
        let refined = DisparityConfig { patch, ..config.clone() };
        let rounds = config.elas.patch_rounds;
        let refinement = Refinement::new(gpu, views, &whole, &images.planes, rounds, &refined)?;
        Ok(Self { whole, images, elas, fit_plane, refinement })
    }

    fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        self.elas.record(frame)?;
        let words = [self.whole.words, self.whole.height, 1];
        frame.stage("disparity filter", |stage| stage.run(&self.fit_plane, words))?;
        self.refinement.record(frame)?;
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
    all.extend(coarse_to_fine::kernels());
    all.extend(elas::kernels());
    all
}
