//! Squeezes the dead slots out of the arrays, in order, outside frames.

#[cfg(test)]
mod compaction_oracle;
mod mark_kept;
mod pack_rows;

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration, PrefixSum, StageTimer};

use crate::store::{Bits, SurfelStore};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 2] = [mark_kept::DECLARATION, pack_rows::DECLARATION];

/// Compaction bound to a store and to the prefix sum over its slots.
#[derive(Debug)]
pub(crate) struct Compaction {
    slots: GpuBuffer<u32>,
    mark: BoundKernel,
    packs: Vec<(BoundKernel, GpuBuffer<Bits>)>,
    packed: GpuBuffer<Bits>,
}

impl Compaction {
    pub fn new(gpu: &Gpu, store: &SurfelStore, kept: &PrefixSum) -> Result<Self, GpuError> {
        let slots = gpu.uniform("compaction slots", &0u32)?;
        let packed = store.scratch.clone();
        let mark = mark_kept::bind(gpu, &slots, store, &kept.flags)?;
        let pack = |rows: GpuBuffer<Bits>| Ok((pack_rows::bind(gpu, &slots, kept, (&rows, &packed))?, rows));
        let packs = store.arrays().into_iter().map(pack).collect::<Result<_, GpuError>>()?;
        Ok(Self { slots, mark, packs, packed })
    }

    /// Packs the first `slots` slots and zeroes those that become free; returns how many are left.
    pub fn run(&self, gpu: &Gpu, timer: &StageTimer, kept: &PrefixSum, slots: u32) -> Result<u32, GpuError> {
        gpu.write(&self.slots, 0, &[slots])?;
        let mut frame = FrameRecorder::begin(gpu, timer);
        frame.stage("compaction", |stage| {
            stage.run(&self.mark, [slots, 1, 1])?;
            kept.record(gpu, stage, slots)
        })?;
        for (pack, rows) in &self.packs {
            frame.clear(&self.packed);
            frame.stage("compaction", |stage| stage.run(pack, [slots, 1, 1]))?;
            frame.copy(&self.packed, rows, slots as usize)?;
        }
        frame.submit().collect()?;
        Ok(gpu.read(&kept.total)?[0])
    }
}
