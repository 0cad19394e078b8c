//! Patches of tissue followed from picture to picture: the matches of `E_corr` (design: section 7), as many as there are
//! textured places, to a fraction of a pixel. The paper takes those of ORB alone, which are a few hundred and whole pixels
//! off where tissue deforms; across the line of sight nothing else holds the model to the tissue. Patches are those of a
//! keyframe: from one picture to the next their small errors would add up.
//!
//! # Cost
//!
//! One dispatch, and two more for a keyframe. In each step a patch of 13 x 13 samples reads for each a row of its template
//! and four pixels, nearly all from the cache: 10 million in all for 2,000 patches and 6 steps.

mod config;
mod follow_patches;
#[cfg(test)]
mod follow_patches_oracle;
mod keyframe;
mod lift_patches;
mod take_templates;

pub use config::FlowConfig;
pub(crate) use keyframe::Keyframe;

use bytemuck::{Pod, Zeroable};
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::Observation;
use crate::store::Row;
use crate::view::GpuView;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 3] =
    [follow_patches::DECLARATION, lift_patches::DECLARATION, take_templates::DECLARATION];

/// `FlowSettings` of the WGSL.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FlowSettings {
    columns: u32,
    rows: u32,
    spacing: u32,
    usable: u32,
    radius: i32,
    steps: u32,
    spread_max_px: f32,
    reach_px: f32,
    misfit_max: f32,
    padding: [u32; 3],
}

impl FlowSettings {
    /// For images of `size`.
    fn new(config: &FlowConfig, size: (u32, u32)) -> Self {
        let (spacing, [columns, rows]) = config.grid(size);
        Self {
            columns,
            rows,
            spacing,
            usable: 0,
            radius: config.radius.cast_signed(),
            steps: config.steps,
            spread_max_px: config.spread_max_px as f32,
            reach_px: config.reach_px as f32,
            misfit_max: config.misfit_max as f32,
            padding: [0; 3],
        }
    }
}

/// What the patches are followed in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlowParts<'a> {
    /// The tracker's view of this frame.
    pub view: &'a GpuBuffer<GpuView>,
    /// The same, corrected by the warp's solve.
    pub refined: &'a GpuBuffer<GpuView>,
    /// Grey values and depth of this frame.
    pub observation: &'a Observation,
    /// Where patches come from.
    pub keyframe: &'a Keyframe,
    /// The first rows are written: the keyframe's pixel, and the pixel.
    pub matches: &'a GpuBuffer<Row>,
}

/// The patches, bound to a frame's buffers.
#[derive(Debug)]
pub(crate) struct PatchFlow {
    settings: FlowSettings,
    uniform: GpuBuffer<FlowSettings>,
    follow: BoundKernel,
    lift: BoundKernel,
    templates: BoundKernel,
}

impl PatchFlow {
    pub fn new(gpu: &Gpu, config: &FlowConfig, parts: &FlowParts) -> Result<Self, GpuError> {
        let settings = FlowSettings::new(config, (parts.observation.width, parts.observation.height));
        let uniform = gpu.uniform("flow settings", &settings)?;
        Ok(Self {
            follow: follow_patches::bind(gpu, &uniform, parts)?,
            lift: lift_patches::bind(gpu, &uniform, parts)?,
            templates: take_templates::bind(gpu, &uniform, parts)?,
            settings,
            uniform,
        })
    }

    /// Says whether there is a keyframe to follow patches from; before the submission.
    pub fn prepare(&mut self, gpu: &Gpu, usable: bool) -> Result<(), GpuError> {
        self.settings.usable = u32::from(usable);
        gpu.write(&self.uniform, 0, &[self.settings])
    }

    /// Records the search.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.stage("flow", |stage| stage.run(&self.follow, [self.patches(), 1, 1]))
    }

    /// Records that this frame's picture is the keyframe of the next ones, as the model shows it now.
    pub fn record_keyframe(
        &self,
        frame: &mut FrameRecorder,
        keyframe: &Keyframe,
        observation: &Observation,
    ) -> Result<(), GpuError> {
        keyframe.record_depth(frame, observation)?;
        let samples = take_templates::samples(self.settings.radius.cast_unsigned()) as u32;
        frame.stage("flow", |stage| {
            stage.run(&self.lift, [self.patches(), 1, 1])?;
            stage.run(&self.templates, [self.patches(), samples, 1])
        })
    }

    fn patches(&self) -> u32 {
        self.settings.columns * self.settings.rows
    }
}
