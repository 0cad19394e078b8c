//! The surfels on the GPU: a structure of arrays, one row of 16 bytes per slot and array.
//!
//! Slots ascend with ids, always: new surfels are appended, compaction keeps the order. So the lowest slot is the
//! oldest surfel, and whatever is packed in slot order is sorted by id.

mod surfel;

pub use surfel::Surfel;
pub(crate) use surfel::{RecordRow, SurfelRows};

use gpu::{FrameRecorder, Gpu, GpuBuffer, GpuError};

/// A row of an array.
pub(crate) type Row = [f32; 4];
/// A row of integers.
pub(crate) type Bits = [u32; 4];

/// State bit: the slot holds a surfel.
pub(crate) const ALIVE: u32 = 1;
/// State bit: it has been seen often enough to be shown.
pub(crate) const STABLE: u32 = 2;

/// All arrays of the model.
#[derive(Clone, Debug)]
pub(crate) struct SurfelStore {
    /// Position in world (m), radius (m).
    pub geometry: GpuBuffer<Row>,
    /// Unit normal in world, weight.
    pub orientation: GpuBuffer<Row>,
    /// Red, green, blue (0-255), colour weight.
    pub appearance: GpuBuffer<Row>,
    /// Id, frame last seen, frame created, state bits.
    pub history: GpuBuffer<Bits>,
    /// What viewers hold; see `compare_published.wgsl`.
    pub held: HeldRows,
    /// A row per slot for what does not outlast a stage.
    pub scratch: GpuBuffer<Bits>,
}

/// Handles to the arrays that are drawn; rows as in `shared/surfel.wgsl`.
#[derive(Clone, Debug)]
pub struct ModelArrays {
    /// Position in world (m), radius (m).
    pub geometry: GpuBuffer<[f32; 4]>,
    /// Unit normal in world, weight.
    pub orientation: GpuBuffer<[f32; 4]>,
    /// Red, green, blue (0-255), colour weight.
    pub appearance: GpuBuffer<[f32; 4]>,
    /// Id, frame last seen, frame created, state bits.
    pub history: GpuBuffer<[u32; 4]>,
    /// Slots in use.
    pub slots: u32,
}

/// The published copy.
#[derive(Clone, Debug)]
pub(crate) struct HeldRows {
    /// Position, radius.
    pub geometry: GpuBuffer<Row>,
    /// Normal, weight.
    pub orientation: GpuBuffer<Row>,
    /// Id, colour, frame last seen, 1 where held.
    pub rest: GpuBuffer<Bits>,
}

impl SurfelStore {
    /// Room for `capacity` surfels, nothing held.
    pub fn new(gpu: &Gpu, capacity: u32) -> Result<Self, GpuError> {
        let len = capacity as usize;
        Ok(Self {
            geometry: gpu.storage("surfel geometry", len)?,
            orientation: gpu.storage("surfel orientation", len)?,
            appearance: gpu.storage("surfel appearance", len)?,
            history: gpu.storage("surfel history", len)?,
            held: HeldRows {
                geometry: gpu.storage("held geometry", len)?,
                orientation: gpu.storage("held orientation", len)?,
                rest: gpu.storage("held rest", len)?,
            },
            scratch: gpu.storage("surfel scratch", len)?,
        })
    }

    /// Slots there are.
    pub fn capacity(&self) -> u32 {
        self.geometry.len() as u32
    }

    /// Marks all slots as not held.
    pub fn clear_held(&self, frame: &mut FrameRecorder) {
        frame.clear(&self.held.rest);
    }

    /// Takes over the first `slots` rows of a smaller store.
    pub fn copy_from(&self, frame: &mut FrameRecorder, smaller: &Self, slots: usize) -> Result<(), GpuError> {
        for (source, target) in smaller.arrays().iter().zip(&self.arrays()) {
            frame.copy(source, target, slots)?;
        }
        Ok(())
    }

    /// All arrays of the model, as rows of bits.
    pub fn arrays(&self) -> [GpuBuffer<Bits>; 7] {
        [
            self.geometry.cast(),
            self.orientation.cast(),
            self.appearance.cast(),
            self.history.clone(),
            self.held.geometry.cast(),
            self.held.orientation.cast(),
            self.held.rest.clone(),
        ]
    }

    /// What viewers hold of the first `slots` surfels, by id.
    pub fn read_held(&self, gpu: &Gpu, slots: u32) -> Result<Vec<Surfel>, GpuError> {
        let slots = slots as usize;
        let geometry = gpu.read_range(&self.held.geometry, 0, slots)?;
        let orientation = gpu.read_range(&self.held.orientation, 0, slots)?;
        let rest = gpu.read_range(&self.held.rest, 0, slots)?;
        let rows = geometry.into_iter().zip(orientation).zip(rest);
        let held = rows.filter(|(_, rest)| rest[3] != 0);
        Ok(held
            .map(|((geometry, orientation), rest)| RecordRow { geometry, orientation, rest }.surfel())
            .collect())
    }

    /// The rows of the first `slots` surfels, read back.
    pub fn read(&self, gpu: &Gpu, slots: u32) -> Result<SurfelRows, GpuError> {
        let slots = slots as usize;
        Ok(SurfelRows {
            geometry: gpu.read_range(&self.geometry, 0, slots)?,
            orientation: gpu.read_range(&self.orientation, 0, slots)?,
            appearance: gpu.read_range(&self.appearance, 0, slots)?,
            history: gpu.read_range(&self.history, 0, slots)?,
        })
    }
}
