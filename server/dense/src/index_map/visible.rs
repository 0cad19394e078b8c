//! The surfels in view.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, PrefixSum, Stage};

use super::{SplatSettings, list_visible, write_visible};
use crate::store::{Row, SurfelStore};
use crate::view::GpuView;

/// Slots that one invocation looks at.
const CHUNK: u32 = 32;

/// The slots of the surfels in a view, ascending.
#[derive(Debug)]
pub(crate) struct VisibleSurfels {
    /// Their number, then their slots.
    pub slots: GpuBuffer<u32>,
    /// Workgroups of 64 along x, y, z for one invocation each.
    pub groups: GpuBuffer<u32>,
    chunks: PrefixSum,
    spheres: GpuBuffer<Row>,
    list: BoundKernel,
    write: BoundKernel,
}

impl VisibleSurfels {
    /// Those of `store` in `view`; counts the deleted in `results`.
    pub fn new(
        gpu: &Gpu,
        (view, settings): (&GpuBuffer<GpuView>, &GpuBuffer<SplatSettings>),
        store: &SurfelStore,
        results: &GpuBuffer<u32>,
    ) -> Result<Self, GpuError> {
        let capacity = store.capacity() as usize;
        let chunks = PrefixSum::new(gpu, capacity.div_ceil(CHUNK as usize))?;
        let masks = gpu.storage("visible masks", capacity.div_ceil(CHUNK as usize))?;
        let spheres = gpu.storage("visible spheres", capacity.div_ceil(CHUNK as usize))?;
        let slots = gpu.storage("visible slots", capacity + 1)?;
        let groups = gpu.storage("visible groups", 3)?;
        let list =
            list_visible::bind(gpu, (view, settings), store, (&masks, &chunks.flags, &spheres), results)?;
        let write = write_visible::bind(gpu, settings, (&masks, &chunks), (&slots, &groups))?;
        Ok(Self { slots, groups, chunks, spheres, list, write })
    }

    /// Forgets where the surfels are: their slots have changed.
    pub fn forget(&self, frame: &mut FrameRecorder) {
        frame.clear(&self.spheres);
    }

    /// Records the list over the first `slots` slots: 6 dispatches.
    pub fn record(&self, gpu: &Gpu, stage: &mut Stage, slots: u32) -> Result<(), GpuError> {
        let chunks = slots.div_ceil(CHUNK);
        stage.run(&self.list, [chunks, 1, 1])?;
        self.chunks.record(gpu, stage, chunks)?;
        stage.run(&self.write, [chunks.max(1), 1, 1])
    }
}
