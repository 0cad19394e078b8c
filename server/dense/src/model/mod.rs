//! The deforming surfel model: one observation and one pose in, the model brought up to date.

mod buffers;
mod report;
mod warping;

pub(crate) use buffers::{FrameBuffers, checked_pixels};
pub use report::{DiscardReason, FusionReport};
use warping::{BoundWarp, SinceLast, Warping};
pub use warping::{Node, WarpReport};

use std::sync::Arc;

use geometry::{Pose, StereoRig};
use gpu::{FrameRecorder, Gpu, KernelDeclaration, PrefixSum, Readback, StageTimer};
use nalgebra::Point3;

use crate::change_set::{ChangeSet, EncodingSteps, HeldNodes, PublishedParts, Publisher};
use crate::compaction::Compaction;
use crate::config::DenseConfig;
use crate::fusion::{Fusion, FusionSettings, HISTOGRAM, RESULTS};
use crate::index_map::SplatSettings;
use crate::node_graph::GraphSettings;
use crate::render::{self, Coloring, Paint, Rendering};
use crate::slam::{Correspondence, TrackedCamera};
use crate::statistics::Statistics;
use crate::store::{ModelArrays, Surfel, SurfelStore};
use crate::tone::{self, ToneFit};
use crate::{
    DenseError, FrameCorrection, Observation, View, bend, change_set, compaction, disparity, flow, followed,
    fusion, index_map, node_graph, preprocess, statistics, warp, warp_solver,
};

/// Largest half width of a disc in the index map, pixels.
const REACH_MAX_PX: f32 = 16.0;
/// Passes of the longest frame: those of the model, and three for each band that disparity is matched in.
const STAGES_MAX: u32 = 320;
/// Odd, so that the seeds of successive frames run through all values.
const SEED_STEP: u32 = 0x9E37_79B9;

/// All kernels of this crate.
pub fn kernels() -> Vec<KernelDeclaration> {
    let folders: [&[KernelDeclaration]; 13] = [
        &index_map::KERNELS,
        &statistics::KERNELS,
        &tone::KERNELS,
        &fusion::KERNELS,
        &compaction::KERNELS,
        &change_set::KERNELS,
        &render::KERNELS,
        &node_graph::KERNELS,
        &warp::KERNELS,
        &flow::KERNELS,
        &warp_solver::KERNELS,
        &followed::KERNELS,
        &bend::KERNELS,
    ];
    let mut all = folders.concat();
    all.extend(disparity::kernels());
    all.extend(preprocess::kernels());
    all
}

/// Everything bound to the present arrays; made anew when they grow.
#[derive(Debug)]
struct Bound {
    buffers: FrameBuffers,
    statistics: Statistics,
    tone: ToneFit,
    fusion: Fusion,
    /// Over slots: compaction and change set use it in turn.
    marked: PrefixSum,
    compaction: Compaction,
    publisher: Publisher,
    warp: BoundWarp,
}

/// What the CPU knows of the arrays between frames.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    slots: u32,
    alive: u32,
    stable: u32,
    next_id: u32,
    rejected_in_row: u32,
    frames: u32,
}

/// The model of one session.
#[derive(Debug)]
pub struct SurfelModel {
    gpu: Arc<Gpu>,
    rig: StereoRig,
    config: DenseConfig,
    bound: Bound,
    settings: FusionSettings,
    counts: Counts,
    results: Readback<u32>,
    lifted: Readback<u32>,
    warping: Warping,
    held_nodes: HeldNodes,
    tracked: Pose,
    /// That of the last frame, corrected.
    refined: Pose,
    timer: StageTimer,
}

impl SurfelModel {
    /// An empty model of what `observation`'s buffers will show of each frame.
    ///
    /// # Errors
    /// [`DenseError::Config`], [`DenseError::TooManyPixels`], [`DenseError::Gpu`].
    pub fn new(
        gpu: Arc<Gpu>,
        rig: StereoRig,
        observation: &Observation,
        config: &DenseConfig,
    ) -> Result<Self, DenseError> {
        config.check()?;
        let pixels = checked_pixels(observation.width, observation.height)?;
        let timer = StageTimer::new(&gpu, STAGES_MAX)?;
        let store = SurfelStore::new(&gpu, config.surfel_capacity)?;
        let warping = Warping::new(&gpu, observation, config)?;
        clear_held(&gpu, &timer, &store)?;
        let mut frame = FrameRecorder::begin(&gpu, &timer);
        let held_nodes = HeldNodes::new(&gpu, &config.nodes)?;
        warping.clear(&mut frame);
        held_nodes.clear(&mut frame);
        frame.submit().collect()?;
        Ok(Self {
            bound: Bound::new(&gpu, &rig, observation, (store, &warping, &held_nodes), config)?,
            warping,
            held_nodes,
            tracked: Pose::identity(),
            refined: Pose::identity(),
            settings: FusionSettings::new(
                config,
                buffers::focal_baseline(&rig),
                buffers::claim_places(pixels),
            ),
            counts: Counts::default(),
            results: Readback::new(&gpu, "results read", RESULTS)?,
            lifted: Readback::new(&gpu, "lifted read", 1)?,
            timer,
            rig,
            config: config.clone(),
            gpu,
        })
    }

    /// Takes the tracker's matches from the last fused frame to the next one; before [`SurfelModel::prepare`].
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn set_matches(&mut self, matches: &[Correspondence]) -> Result<(), DenseError> {
        let usable = if self.continues() { matches } else { &[] };
        Ok(self.warping.set_matches(&self.gpu, usable)?)
    }

    /// Takes up material points, by id, where they are in the model's present shape (world, metres).
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn follow(&mut self, points: &[(u32, Point3<f64>)]) -> Result<(), DenseError> {
        Ok(self.warping.follow(&self.gpu, points)?)
    }

    /// Where the material points are now, in the order in which they were taken up.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn followed(&self) -> Result<Vec<(u32, Point3<f64>)>, DenseError> {
        Ok(self.warping.followed(&self.gpu)?)
    }

    /// Takes the model along with a correction of the map: what was last seen in a frame goes with the world of that
    /// frame. Corrections are of ascending frames, the last one that of the camera. A rigid model stays as it is.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn bend(&mut self, corrections: &[FrameCorrection]) -> Result<(), DenseError> {
        let Some(last) = corrections.last().filter(|_| !self.warping.is_rigid()) else { return Ok(()) };
        let slots = self.counts.slots;
        let view = View { pinhole: self.rig.left, world_from_camera: last.after_from_before * self.refined };
        self.warping.prepare_bend(&self.gpu, slots, corrections, view)?;
        let Bound { buffers, warp, .. } = &self.bound;
        let mut frame = FrameRecorder::begin(&self.gpu, &self.timer);
        self.warping.record_bend(&mut frame, warp, slots)?;
        // what the camera sees may be what it did not see before
        buffers.index_map.visible.forget(&mut frame);
        frame.submit().collect()?;
        self.refined = view.world_from_camera;
        self.tracked = last.after_from_before * self.tracked;
        Ok(())
    }

    /// Whether the last frame was fused: else what is kept of it is not what matches and patches start from.
    fn continues(&self) -> bool {
        self.counts.rejected_in_row == 0
    }

    /// Makes room and sets the frame's camera and settings; call it before [`SurfelModel::record`].
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn prepare(&mut self, frame_index: u32, camera: &TrackedCamera) -> Result<(), DenseError> {
        self.make_room()?;
        let view = View { pinhole: self.rig.left, world_from_camera: self.first_pose(camera) };
        self.gpu.write(&self.bound.buffers.view, 0, &[view.to_gpu()])?;
        let counts = &self.counts;
        self.settings.slots = counts.slots;
        self.settings.capacity = self.bound.buffers.store.capacity();
        self.settings.frame = frame_index;
        self.settings.next_id = counts.next_id;
        self.settings.seed = counts.frames.wrapping_mul(SEED_STEP);
        self.settings.accept_always =
            u32::from(counts.rejected_in_row >= self.config.rejection.frames_in_row_max);
        self.gpu.write(&self.bound.buffers.settings, 0, &[self.settings])?;
        let tick = (counts.slots, frame_index, counts.frames);
        let since = SinceLast { continues: self.continues(), at_rest: camera.at_rest };
        self.warping.prepare(&self.gpu, &mut self.bound.warp, tick, since)?;
        self.tracked = camera.world_from_camera;
        Ok(())
    }

    /// Where the solve begins. A camera at rest keeps the last frame's correction too.
    fn first_pose(&self, camera: &TrackedCamera) -> Pose {
        let correction =
            if camera.at_rest { self.tracked.inverse() * self.refined } else { Pose::identity() };
        camera.world_from_camera * correction
    }

    /// Records index map, statistics and fusion behind whatever writes the observation.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), DenseError> {
        let Bound { buffers, statistics, tone, fusion, warp, .. } = &self.bound;
        let surfels = (buffers, self.counts.slots);
        let scale = self.config.index_map_scale;
        let splat = SplatSettings {
            slots: self.counts.slots,
            scale,
            stable_only: 0,
            reach_max: REACH_MAX_PX * scale as f32,
            forget_before: self.settings.frame.saturating_sub(self.config.fusion.unseen_frames_max),
            tick: self.counts.frames,
        };
        frame.clear(&buffers.results);
        buffers.index_map.record(&self.gpu, frame, &splat)?;
        statistics.record(frame, buffers)?;
        if !self.warping.is_rigid() {
            self.warping.record_warp(frame, warp, surfels)?;
            buffers.index_map.record(&self.gpu, frame, &splat)?;
            // judged again, as it will be fused; the counts of deleted surfels stay
            frame.clear_range(&buffers.results, 0..1)?;
            frame.clear_range(&buffers.results, HISTOGRAM..RESULTS)?;
            statistics.record(frame, buffers)?;
        }
        tone.record(frame, buffers)?;
        fusion.record(&self.gpu, frame, buffers, &self.settings)?;
        self.warping.record_end(frame, warp, surfels)?;
        self.results.fetch(frame, &buffers.results, 0);
        self.lifted.fetch(frame, &buffers.lifted.total, 0);
        Ok(())
    }

    /// Reads the submitted frame's result block and takes its counts over.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn finish(&mut self) -> Result<FusionReport, DenseError> {
        let results = self.results.read(&self.gpu)?;
        let wanted = self.lifted.read(&self.gpu)?[0];
        let warp = self.warping.finish(&self.gpu, &self.tracked)?;
        self.refined = warp.world_from_camera;
        let before = self.surfel_counts();
        let report = FusionReport::new(&results, before, (wanted, &self.settings), warp, &self.config);
        let counts = &mut self.counts;
        counts.slots += report.lifted;
        counts.next_id += report.lifted;
        counts.alive = report.surfels;
        counts.stable = report.stable;
        counts.frames = counts.frames.wrapping_add(1);
        counts.rejected_in_row = if report.discarded.is_none() { 0 } else { counts.rejected_in_row + 1 };
        Ok(report)
    }

    /// The changes since the last call, taken over into the published copy as `steps` encode them.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn take_changes(&mut self, steps: &EncodingSteps) -> Result<ChangeSet, DenseError> {
        let Bound { publisher, marked, .. } = &self.bound;
        let device = (&*self.gpu, &self.timer);
        Ok(publisher.take(device, marked, &mut self.held_nodes, steps, self.counts.slots)?)
    }

    /// The published copy, sorted by id.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn held_surfels(&self) -> Result<Vec<Surfel>, DenseError> {
        Ok(self.bound.buffers.store.read_held(&self.gpu, self.counts.slots)?)
    }

    /// The stable model, sorted by id.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn surfels(&self) -> Result<Vec<Surfel>, DenseError> {
        Ok(self.bound.buffers.store.read(&self.gpu, self.counts.slots)?.stable())
    }

    /// The arrays that the model lives in now.
    pub fn arrays(&self) -> ModelArrays {
        let SurfelStore { geometry, orientation, appearance, history, .. } = self.bound.buffers.store.clone();
        ModelArrays { geometry, orientation, appearance, history, slots: self.counts.slots }
    }

    /// The deformation nodes.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn nodes(&self) -> Result<Vec<Node>, DenseError> {
        Ok(self.warping.nodes(&self.gpu)?)
    }

    /// A picture of the stable model.
    ///
    /// # Errors
    /// [`DenseError::TooManyPixels`], [`DenseError::Gpu`].
    pub fn render(
        &self,
        view: &View,
        coloring: Coloring,
        background: [u8; 3],
    ) -> Result<Rendering, DenseError> {
        let store = (&self.bound.buffers.store, self.counts.slots);
        let paint = Paint { coloring, weight_max: self.config.fusion.weight_max, background };
        render::render(&self.gpu, &self.timer, store, view, paint)
    }

    /// The options it was made with.
    pub fn config(&self) -> &DenseConfig {
        &self.config
    }

    /// The timer for the model's frames.
    pub fn timer(&self) -> &StageTimer {
        &self.timer
    }

    /// Surfels alive, and among them stable, after the last frame.
    pub fn surfel_counts(&self) -> (u32, u32) {
        (self.counts.alive, self.counts.stable)
    }

    /// Compacts where enough slots are dead, then grows until a frame's every pixel would find a slot, within the limit.
    fn make_room(&mut self) -> Result<(), DenseError> {
        let dead = self.counts.slots - self.counts.alive;
        if f64::from(dead) > self.config.compaction_dead_share * f64::from(self.counts.slots.max(1)) {
            let Bound { compaction, marked, buffers, .. } = &self.bound;
            self.counts.slots = compaction.run(&self.gpu, &self.timer, marked, self.counts.slots)?;
            let mut frame = FrameRecorder::begin(&self.gpu, &self.timer);
            buffers.index_map.visible.forget(&mut frame);
            frame.submit().collect()?;
        }
        let capacity = self.bound.buffers.store.capacity();
        let wanted = self.counts.slots.saturating_add(self.bound.buffers.observation.pixels());
        let grown = wanted.next_power_of_two().min(self.config.surfel_limit);
        if grown > capacity {
            self.grow(grown)?;
        }
        Ok(())
    }

    fn grow(&mut self, capacity: u32) -> Result<(), DenseError> {
        let store = SurfelStore::new(&self.gpu, capacity)?;
        clear_held(&self.gpu, &self.timer, &store)?;
        let mut frame = FrameRecorder::begin(&self.gpu, &self.timer);
        store.copy_from(&mut frame, &self.bound.buffers.store, self.counts.slots as usize)?;
        let observation = self.bound.buffers.observation.clone();
        let kept = (store, &self.warping, &self.held_nodes);
        let grown = Bound::new(&self.gpu, &self.rig, &observation, kept, &self.config)?;
        grown.tone.copy_from(&mut frame, &self.bound.tone)?;
        frame.submit().collect()?;
        self.bound = grown;
        Ok(())
    }
}

impl Bound {
    fn new(
        gpu: &Gpu,
        rig: &StereoRig,
        observation: &Observation,
        (store, warping, held_nodes): (SurfelStore, &Warping, &HeldNodes),
        config: &DenseConfig,
    ) -> Result<Self, DenseError> {
        let marked = PrefixSum::new(gpu, store.capacity() as usize)?;
        let compaction = Compaction::new(gpu, &store, &marked)?;
        let published = PublishedParts {
            store: &store,
            nodes: warping.store(),
            held_nodes,
            changed: &marked,
            reach_m: GraphSettings::new(&config.nodes).reach_m,
        };
        let publisher = Publisher::new(gpu, &published, &config.publish)?;
        let buffers = FrameBuffers::new(gpu, rig, observation, store, config)?;
        let warp = warping.bind(gpu, &buffers)?;
        let statistics = Statistics::new(gpu, &buffers)?;
        let tone = ToneFit::new(gpu, &buffers)?;
        let fusion = Fusion::new(gpu, &buffers)?;
        Ok(Self { buffers, statistics, tone, fusion, marked, compaction, publisher, warp })
    }
}

fn clear_held(gpu: &Gpu, timer: &StageTimer, store: &SurfelStore) -> Result<(), DenseError> {
    let mut frame = FrameRecorder::begin(gpu, timer);
    store.clear_held(&mut frame);
    frame.submit().collect()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_kernel_matches_its_declaration() {
        for declaration in super::kernels() {
            declaration.reflect().unwrap();
        }
    }
}
