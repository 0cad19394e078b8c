//! Semi-global matching from coarse to fine.
//!
//! All disparities are searched only where the image has been halved a few times ([`Search`]); its surfaces, extended
//! into holes, are the prior of the next finer level. There 16 disparities about the prior are matched, along which
//! paths follow slanted surfaces without penalty, and planar patches are refined by inverse search ([`Refinement`]).
//! The finest level is refined alone, and loses what the right eye cannot have seen.

mod aim_patch;
#[cfg(test)]
mod aim_patch_oracle;
mod band_cost;
#[cfg(test)]
mod band_oracle;
mod band_winner;
mod descend;
#[cfg(test)]
mod descend_oracle;
mod fill_holes;
#[cfg(test)]
mod fill_holes_oracle;
mod fit_patch;
#[cfg(test)]
mod fit_patch_oracle;
mod halve;
#[cfg(test)]
mod halve_oracle;
mod hide;
#[cfg(test)]
mod hide_oracle;
mod high_pass;
#[cfg(test)]
mod high_pass_oracle;
mod level;
mod pool_targets;
#[cfg(test)]
mod pool_targets_oracle;
mod pyramid;
mod refinement;
mod search;
#[cfg(test)]
mod testing;

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, KernelDeclaration};

use self::hide::Hiding;
use self::level::FinerLevel;
use self::pyramid::Pyramid;
pub(super) use self::refinement::{Refinement, Views};
use self::search::Search;
use super::band::Band;
use super::config::DisparityConfig;
use super::range::DisparityRange;
use crate::DenseError;
use crate::preprocess::Preprocess;

/// Shorter side, in pixels, of the smallest image in which disparities are searched.
const COARSE_SIDE_MIN: u32 = 48;

/// The kernels of all levels, bound.
#[derive(Debug)]
pub(super) struct CoarseToFine {
    pyramid: Pyramid,
    search: Search,
    /// From the second coarsest to the finest.
    finer: Vec<FinerLevel>,
    hide: BoundKernel,
    rows: u32,
    planes: GpuBuffer<[f32; 4]>,
}

impl CoarseToFine {
    /// Room and kernels for pairs of `input`'s size.
    pub fn new(
        gpu: &Gpu,
        input: &Preprocess,
        range: DisparityRange,
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let coarsest = coarse_level(input.size(), config.sgm.coarse_level);
        let pyramid = Pyramid::new(gpu, input, coarsest)?;
        let level =
            |level: u32| (pyramid.size(level), (pyramid.eyes(input, level), pyramid.views(input, level)));
        let (size, images) = level(coarsest);
        let whole = Band::whole(size, range.halved(coarsest)?);
        let search = Search::new(gpu, images, whole, coarsest, config)?;
        let mut finer: Vec<FinerLevel> = Vec::new();
        for index in (0..coarsest).rev() {
            let (size, images) = level(index);
            let coarse = finer.last().map_or(search.planes(), FinerLevel::planes);
            let whole = Band::whole(size, DisparityRange { min_px: range.min_px, groups: 1 });
            finer.push(FinerLevel::new(
                gpu,
                images,
                (whole, index),
                (pyramid.size(index + 1), coarse),
                config,
            )?);
        }
        let planes = finer.last().map_or(search.planes(), FinerLevel::planes).clone();
        let (width, rows) = input.size();
        let nearest = gpu.storage("nearest surface", (width * rows) as usize)?;
        let whole = gpu.uniform("whole image", &Band::whole(input.size(), range))?;
        let hiding = Hiding::new(range, config.patch.hidden_tolerance_px);
        let hide = hide::bind(gpu, &whole, &hiding, &input.left().masked, (&nearest, &planes))?;
        Ok(Self { pyramid, search, finer, hide, rows, planes })
    }

    /// Records the matching of the prepared pair.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        self.pyramid.record(frame)?;
        self.search.record(frame)?;
        self.finer.iter().try_for_each(|level| level.record(frame))?;
        frame.stage("hidden surfaces", |stage| stage.run(&self.hide, [self.rows, 1, 1]))?;
        Ok(())
    }

    /// As of [`super::DisparityStage::planes`].
    pub fn planes(&self) -> &GpuBuffer<[f32; 4]> {
        &self.planes
    }

    /// Bands of rows that the coarsest level is searched in.
    pub fn band_count(&self) -> usize {
        self.search.band_count()
    }
}

/// The level that is searched, of those up to `wanted`: small images are not halved as often.
fn coarse_level((width, height): (u32, u32), wanted: u32) -> u32 {
    let side = width.min(height);
    (0..=wanted).rev().find(|level| side >> level >= COARSE_SIDE_MIN).unwrap_or(0)
}

/// The declarations of the kernels of this folder.
pub(super) fn kernels() -> Vec<KernelDeclaration> {
    vec![
        halve::DECLARATION,
        high_pass::DECLARATION,
        fill_holes::DECLARATION,
        aim_patch::DECLARATION,
        pool_targets::DECLARATION,
        fit_patch::DECLARATION,
        descend::DECLARATION,
        band_cost::DECLARATION,
        band_winner::DECLARATION,
        hide::DECLARATION,
    ]
}

#[cfg(test)]
mod tests {
    use super::coarse_level;

    #[test]
    fn small_images_are_halved_less_often() {
        assert_eq!(coarse_level((640, 480), 2), 2);
        assert_eq!(coarse_level((161, 120), 2), 1);
        assert_eq!(coarse_level((161, 47), 2), 0);
        assert_eq!(coarse_level((1920, 1080), 0), 0);
    }
}
