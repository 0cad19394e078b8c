//! Inverse search of planar patches at one level.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::fit_patch::Patch;
use super::high_pass::ROWS;
use super::{aim_patch, fit_patch, high_pass, pool_targets};
use crate::disparity::band::Band;
use crate::disparity::{DisparityConfig, DisparityRange};
use crate::preprocess::Eyes;

/// The images that patches are matched in.
#[derive(Clone, Copy, Debug)]
pub(in crate::disparity) struct Views<'a> {
    pub eyes: Eyes<'a>,
    /// Columns, rows.
    pub size: (u32, u32),
    /// Pixels to a side of one element of the planes.
    pub cell: u32,
}

/// Improves planes in place, a few rounds a frame.
#[derive(Debug)]
pub(in crate::disparity) struct Refinement {
    grid: [u32; 3],
    blocks: [u32; 3],
    strips: [u32; 3],
    high_pass: [BoundKernel; 2],
    aim: BoundKernel,
    pool: BoundKernel,
    fit: BoundKernel,
    rounds: u32,
}

impl Refinement {
    /// Of `planes` in the grid `whole`.
    pub fn new(
        gpu: &Gpu,
        views: Views,
        whole: &Band,
        planes: &GpuBuffer<[f32; 4]>,
        rounds: u32,
        config: &DisparityConfig,
    ) -> Result<Self, GpuError> {
        let uniform = gpu.uniform("level", whole)?;
        let image = Band::whole(views.size, DisparityRange { min_px: 0, groups: 1 });
        let of_image = gpu.uniform("views", &image)?;
        let passed =
            [gpu.storage("left high pass", image.pixels())?, gpu.storage("right high pass", image.pixels())?];
        let targets = &gpu.storage("patch targets", whole.pixels())?;
        let pooled = gpu.storage("pooled patch targets", whole.pixels())?;
        let patch = Patch::new(&config.patch);
        Ok(Self {
            grid: [whole.width, whole.height, 1],
            blocks: [whole.width.div_ceil(2), whole.height.div_ceil(2), 1],
            strips: [image.words, image.height.div_ceil(ROWS), 1],
            high_pass: [
                high_pass::bind(gpu, &of_image, views.eyes.left, &passed[0])?,
                high_pass::bind(gpu, &of_image, views.eyes.right, &passed[1])?,
            ],
            aim: aim_patch::bind(
                gpu,
                &uniform,
                &config.patch,
                (views.size, views.cell),
                &passed,
                (planes, targets),
            )?,
            pool: pool_targets::bind(gpu, &uniform, config.patch.gate_px, (targets, planes), &pooled)?,
            fit: fit_patch::bind(gpu, &uniform, &patch, &pooled, planes)?,
            rounds,
        })
    }

    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        if self.rounds == 0 {
            return Ok(());
        }
        frame.stage("high pass", |stage| {
            self.high_pass.iter().try_for_each(|kernel| stage.run(kernel, self.strips))
        })?;
        frame.stage("patch refinement", |stage| {
            (0..self.rounds).try_for_each(|_| {
                stage.run(&self.aim, self.grid)?;
                stage.run(&self.pool, self.blocks)?;
                stage.run(&self.fit, self.blocks)
            })
        })
    }
}
