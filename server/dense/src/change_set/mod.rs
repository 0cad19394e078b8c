//! What has changed since viewers were last told: the model against the published copy, compared on the GPU.
//!
//! The published copy is what every viewer holds (design section 8). Each time, it is moved by the *encoded* warp, as
//! viewers move theirs; then whatever differs from the model by more than the bounds is sent. So the error at a viewer
//! is bounded whatever the warp explains, and the largest error left is measured.

#[cfg(test)]
mod change_oracle;
mod compare_published;
mod emit_changes;
#[cfg(test)]
mod encode_oracle;
mod encode_warp;
mod follow_nodes;
mod held_nodes;
mod settings;

pub(crate) use held_nodes::HeldNodes;
pub use held_nodes::{NodePlace, TransformCodes, WarpChanges};
pub use settings::EncodingSteps;

use gpu::{
    BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum, StageTime, StageTimer,
};

use crate::config::PublishConfig;
use crate::node_graph::{NodeFinder, NodeStore};
use crate::store::{RecordRow, Surfel, SurfelStore};
use crate::warp::{StirredCells, SurfelWarp, WarpParts};
use settings::PublishSettings;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 4] = [
    encode_warp::DECLARATION,
    follow_nodes::DECLARATION,
    compare_published::DECLARATION,
    emit_changes::DECLARATION,
];

const ADDED: u32 = 0;
const UPDATED: u32 = 1;

/// How what viewers hold is brought to the model: the warp first, then the surfels that it does not explain, those that
/// appeared and those that went. Each list is sorted by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeSet {
    /// Motion of all that viewers hold.
    pub warp: WarpChanges,
    /// New to viewers.
    pub added: Vec<Surfel>,
    /// Known to viewers, in their new state.
    pub updated: Vec<Surfel>,
    /// Ids no longer shown.
    pub removed: Vec<u32>,
    /// Largest distance between a surfel that viewers hold and were not sent, and the model's; metres.
    pub max_error_m: f32,
    /// Time taken.
    pub stages: Vec<StageTime>,
}

impl ChangeSet {
    /// Whether viewers are up to date.
    pub fn is_empty(&self) -> bool {
        self.warp.is_empty() && self.added.is_empty() && self.updated.is_empty() && self.removed.is_empty()
    }

    fn push(&mut self, record: &RecordRow) {
        match record.rest[3] {
            ADDED => self.added.push(record.surfel()),
            UPDATED => self.updated.push(record.surfel()),
            _removed => self.removed.push(record.rest[0]),
        }
    }
}

/// The published copy of one session's model and the passes over it, bound to the present arrays.
#[derive(Debug)]
pub(crate) struct Publisher {
    settings: GpuBuffer<PublishSettings>,
    config: PublishConfig,
    reach_m: f32,
    node_slots: u32,
    encode: BoundKernel,
    finder: NodeFinder,
    stirred: StirredCells,
    warp: SurfelWarp,
    follow: BoundKernel,
    compare: BoundKernel,
    emit: BoundKernel,
    records: GpuBuffer<RecordRow>,
    worst: GpuBuffer<u32>,
}

/// What a [`Publisher`] is bound to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PublishedParts<'a> {
    pub store: &'a SurfelStore,
    pub nodes: &'a NodeStore,
    pub held_nodes: &'a HeldNodes,
    /// Over the slots of `store`.
    pub changed: &'a PrefixSum,
    /// Reach of a node.
    pub reach_m: f32,
}

impl Publisher {
    pub fn new(gpu: &Gpu, parts: &PublishedParts, config: &PublishConfig) -> Result<Self, GpuError> {
        let PublishedParts { store, nodes, held_nodes, changed, reach_m } = *parts;
        let settings = gpu.uniform("publish settings", &bytemuck::Zeroable::zeroed())?;
        let records = gpu.storage("change records", config.batch as usize)?;
        let worst = gpu.storage("worst error", 1)?;
        let warp = WarpParts {
            settings: &nodes.settings,
            rows: &held_nodes.rows,
            hash: &held_nodes.hash,
            transforms: &held_nodes.transforms,
            geometry: &store.held.geometry,
            orientation: &store.held.orientation,
            state: &store.held.rest,
        };
        let stirred = StirredCells::new(gpu, &warp)?;
        Ok(Self {
            encode: encode_warp::bind(gpu, &settings, nodes, held_nodes)?,
            finder: NodeFinder::new(gpu, &nodes.settings, &held_nodes.rows, &held_nodes.hash)?,
            warp: SurfelWarp::new(gpu, &warp, &stirred)?,
            stirred,
            follow: follow_nodes::bind(gpu, &settings, nodes, held_nodes)?,
            compare: compare_published::bind(gpu, &settings, store, (changed, &worst))?,
            emit: emit_changes::bind(gpu, &settings, store, (changed, &records))?,
            config: config.clone(),
            reach_m,
            node_slots: nodes.capacity(),
            settings,
            records,
            worst,
        })
    }

    /// Moves the published copy by the encoded warp, takes the changes of the first `slots` slots over into it and
    /// returns both.
    pub fn take(
        &self,
        (gpu, timer): (&Gpu, &StageTimer),
        changed: &PrefixSum,
        held_nodes: &mut HeldNodes,
        steps: &EncodingSteps,
        slots: u32,
    ) -> Result<ChangeSet, GpuError> {
        let settings = PublishSettings::new(&self.config, steps, self.reach_m, slots);
        gpu.write(&self.settings, 0, &[settings])?;
        let mut changes = ChangeSet::default();
        let mut frame = FrameRecorder::begin(gpu, timer);
        self.record_warp(&mut frame, slots)?;
        loop {
            frame.clear(&self.worst);
            frame.stage("change set", |stage| {
                stage.run(&self.compare, [slots, 1, 1])?;
                changed.record(gpu, stage, slots)?;
                stage.run(&self.emit, [slots, 1, 1])
            })?;
            let times = frame.submit().collect()?;
            let total = gpu.read(&changed.total)?[0];
            let count = total.min(self.config.batch);
            let records = gpu.read_range(&self.records, 0, count as usize)?;
            records.iter().for_each(|record| changes.push(record));
            add_times(&mut changes.stages, times.stages);
            if total == count {
                break;
            }
            frame = FrameRecorder::begin(gpu, timer);
        }
        changes.max_error_m = f32::from_bits(gpu.read(&self.worst)?[0]);
        changes.warp = held_nodes.take(gpu, self.reach_m)?;
        Ok(changes)
    }

    /// 5 dispatches: codes, hash, stirred cells, surfels, nodes.
    fn record_warp(&self, frame: &mut FrameRecorder, slots: u32) -> Result<(), GpuError> {
        frame.stage("change set", |stage| stage.run(&self.encode, [self.node_slots, 1, 1]))?;
        self.finder.record(frame)?;
        self.stirred.record(frame)?;
        self.warp.record(frame, slots)?;
        frame.stage("change set", |stage| stage.run(&self.follow, [self.node_slots, 1, 1]))
    }
}

fn add_times(sum: &mut Vec<StageTime>, times: Vec<StageTime>) {
    for time in times {
        match sum.iter_mut().find(|stage| stage.name == time.name) {
            Some(stage) => stage.ms += time.ms,
            None => sum.push(time),
        }
    }
}
