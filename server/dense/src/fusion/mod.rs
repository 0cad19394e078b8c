//! Fusion of one observation into the model under a known pose (paper section "Model update with new observation").
//!
//! Registration runs from surfel to pixel, so no atomics order it; where several surfels or pixels want one cell of the
//! point grid, an integer maximum decides. Both give the same bits on every run.

mod claim_pixels;
mod claim_surfels;
mod fuse;
#[cfg(test)]
mod fuse_oracle;
#[cfg(test)]
mod insertion_oracle;
mod lift;
mod mark_lifted;
mod settings;
mod settle;

#[cfg(test)]
pub(crate) use settings::ERROR_BINS;
pub(crate) use settings::{FusionSettings, HELD_OUT_HISTOGRAM, HISTOGRAM, RESULTS};

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuError, KernelDeclaration};

use crate::model::FrameBuffers;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 6] = [
    fuse::DECLARATION,
    claim_surfels::DECLARATION,
    claim_pixels::DECLARATION,
    mark_lifted::DECLARATION,
    settle::DECLARATION,
    lift::DECLARATION,
];

/// The passes of fusion, bound to a frame's buffers.
#[derive(Debug)]
pub(crate) struct Fusion {
    fuse: BoundKernel,
    claim_surfels: BoundKernel,
    claim_pixels: BoundKernel,
    mark_lifted: BoundKernel,
    settle: BoundKernel,
    lift: BoundKernel,
}

impl Fusion {
    pub fn new(gpu: &Gpu, frame: &FrameBuffers) -> Result<Self, GpuError> {
        Ok(Self {
            fuse: fuse::bind(gpu, frame)?,
            claim_surfels: claim_surfels::bind(gpu, frame)?,
            claim_pixels: claim_pixels::bind(gpu, frame)?,
            mark_lifted: mark_lifted::bind(gpu, frame)?,
            settle: settle::bind(gpu, frame)?,
            lift: lift::bind(gpu, frame)?,
        })
    }

    /// Records registration and averaging, then insertion and culling.
    pub fn record(
        &self,
        gpu: &Gpu,
        frame: &mut FrameRecorder,
        buffers: &FrameBuffers,
        settings: &FusionSettings,
    ) -> Result<(), GpuError> {
        let (visible, pixels) = (&buffers.index_map.visible.groups, [buffers.observation.pixels(), 1, 1]);
        frame.stage("fusion", |stage| stage.run_indirect(&self.fuse, visible))?;
        frame.clear(&buffers.covered);
        frame.clear(&buffers.claims);
        frame.clear(&buffers.lifted.flags);
        frame.stage("insertion", |stage| {
            stage.run_indirect(&self.claim_surfels, visible)?;
            stage.run(&self.claim_pixels, pixels)?;
            stage.run(&self.mark_lifted, [settings.table_mask + 1, 1, 1])?;
            stage.run_indirect(&self.settle, visible)?;
            buffers.lifted.record(gpu, stage, pixels[0])?;
            stage.run(&self.lift, pixels)
        })
    }
}
