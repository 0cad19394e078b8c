//! What has changed since viewers were last told: the model against the published copy, compared on the GPU.

#[cfg(test)]
mod change_oracle;
mod compare_published;
mod emit_changes;

use bytemuck::{Pod, Zeroable};
use gpu::{
    BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum, StageTime, StageTimer,
};

use crate::config::{PublishConfig, metres};
use crate::store::{RecordRow, Surfel, SurfelStore};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 2] =
    [compare_published::DECLARATION, emit_changes::DECLARATION];

const ADDED: u32 = 0;
const UPDATED: u32 = 1;

/// The stable surfels that appeared, changed beyond the publishing bounds or went, each list sorted by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChangeSet {
    /// New to viewers.
    pub added: Vec<Surfel>,
    /// Known to viewers, in their new state.
    pub updated: Vec<Surfel>,
    /// Ids no longer shown.
    pub removed: Vec<u32>,
    /// Time taken.
    pub stages: Vec<StageTime>,
}

impl ChangeSet {
    /// Whether viewers are up to date.
    pub fn is_empty(&self) -> bool {
        self.added.is_empty() && self.updated.is_empty() && self.removed.is_empty()
    }

    fn push(&mut self, record: &RecordRow) {
        match record.rest[3] {
            ADDED => self.added.push(record.surfel()),
            UPDATED => self.updated.push(record.surfel()),
            _removed => self.removed.push(record.rest[0]),
        }
    }
}

/// `PublishSettings` of the kernels.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PublishSettings {
    slots: u32,
    batch: u32,
    position_m: f32,
    normal_cos: f32,
    color_levels: f32,
    weight_step: f32,
}

impl PublishSettings {
    pub fn new(config: &PublishConfig) -> Self {
        Self {
            slots: 0,
            batch: config.batch,
            position_m: metres(config.position_mm),
            normal_cos: config.normal_deg.to_radians().cos() as f32,
            color_levels: config.color_levels as f32,
            weight_step: config.weight_step as f32,
        }
    }
}

/// The comparison bound to a store and to the prefix sum over its slots.
#[derive(Debug)]
pub(crate) struct Publisher {
    settings: GpuBuffer<PublishSettings>,
    values: PublishSettings,
    compare: BoundKernel,
    emit: BoundKernel,
    records: GpuBuffer<RecordRow>,
}

impl Publisher {
    pub fn new(
        gpu: &Gpu,
        store: &SurfelStore,
        changed: &PrefixSum,
        config: &PublishConfig,
    ) -> Result<Self, GpuError> {
        let values = PublishSettings::new(config);
        let settings = gpu.uniform("publish settings", &values)?;
        let records = gpu.storage("change records", config.batch as usize)?;
        let compare = compare_published::bind(gpu, &settings, store, changed)?;
        let emit = emit_changes::bind(gpu, &settings, store, (changed, &records))?;
        Ok(Self { settings, values, compare, emit, records })
    }

    /// Takes the changes of the first `slots` slots over into the published copy and returns them.
    pub fn take(
        &self,
        gpu: &Gpu,
        timer: &StageTimer,
        changed: &PrefixSum,
        slots: u32,
    ) -> Result<ChangeSet, GpuError> {
        let mut changes = ChangeSet::default();
        let settings = PublishSettings { slots, ..self.values };
        gpu.write(&self.settings, 0, &[settings])?;
        loop {
            let mut frame = FrameRecorder::begin(gpu, timer);
            frame.stage("change set", |stage| {
                stage.run(&self.compare, [slots, 1, 1])?;
                changed.record(gpu, stage, slots)?;
                stage.run(&self.emit, [slots, 1, 1])
            })?;
            let times = frame.submit().collect()?;
            let total = gpu.read(&changed.total)?[0];
            let count = total.min(self.values.batch);
            let records = gpu.read_range(&self.records, 0, count as usize)?;
            records.iter().for_each(|record| changes.push(record));
            add_times(&mut changes.stages, times.stages);
            if total == count {
                return Ok(changes);
            }
        }
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
