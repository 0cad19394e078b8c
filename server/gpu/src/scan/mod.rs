//! Exclusive prefix sum of flags: where each flagged element goes when the flagged ones are packed in order.
//!
//! Four passes that accumulate in registers, without barriers: those cost 50 times more on a software GPU.

use crate::Binding::{Read, ReadWrite, Uniform};
use crate::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration, Stage};

const COUNT_CHUNKS: KernelDeclaration =
    KernelDeclaration::new("count_chunks", include_str!("count_chunks.wgsl"), &[Uniform, Read, ReadWrite]);
const SCAN_CHUNKS: KernelDeclaration =
    KernelDeclaration::new("scan_chunks", include_str!("scan_chunks.wgsl"), &[Uniform, ReadWrite, ReadWrite]);
const SCAN_BLOCKS: KernelDeclaration =
    KernelDeclaration::new("scan_blocks", include_str!("scan_blocks.wgsl"), &[Uniform, ReadWrite, ReadWrite]);
const SPREAD_OFFSETS: KernelDeclaration = KernelDeclaration::new(
    "spread_offsets",
    include_str!("spread_offsets.wgsl"),
    &[Uniform, Read, Read, Read, ReadWrite],
);

const CHUNK: u32 = 64;
const BLOCK: u32 = CHUNK * CHUNK;

/// A prefix sum over up to `capacity` flags, bound to its own buffers.
#[derive(Debug)]
pub struct PrefixSum {
    count: GpuBuffer<u32>,
    passes: [BoundKernel; 4],
    /// Input: 0 or 1 per element.
    pub flags: GpuBuffer<u32>,
    /// Output: the number of ones before each element.
    pub offsets: GpuBuffer<u32>,
    /// Output: the number of ones, in its one element.
    pub total: GpuBuffer<u32>,
}

impl PrefixSum {
    /// Compiles the passes and makes the buffers.
    ///
    /// # Errors
    /// As [`Gpu::storage`] and [`Gpu::kernel`].
    pub fn new(gpu: &Gpu, capacity: usize) -> Result<Self, GpuError> {
        let count = gpu.uniform("scan count", &0u32)?;
        let flags = gpu.storage("scan flags", capacity)?;
        let offsets = gpu.storage("scan offsets", capacity)?;
        let total = gpu.storage("scan total", 1)?;
        let chunks: GpuBuffer<u32> = gpu.storage("scan chunks", capacity.div_ceil(CHUNK as usize))?;
        let blocks: GpuBuffer<u32> = gpu.storage("scan blocks", capacity.div_ceil(BLOCK as usize))?;
        let kernel = |declaration| gpu.kernel(declaration);
        let passes = [
            kernel(&COUNT_CHUNKS)?.bind(gpu, &[&count, &flags, &chunks])?,
            kernel(&SCAN_CHUNKS)?.bind(gpu, &[&count, &chunks, &blocks])?,
            kernel(&SCAN_BLOCKS)?.bind(gpu, &[&count, &blocks, &total])?,
            kernel(&SPREAD_OFFSETS)?.bind(gpu, &[&count, &flags, &chunks, &blocks, &offsets])?,
        ];
        Ok(Self { count, passes, flags, offsets, total })
    }

    /// Records the sum over the first `count` flags. One `count` holds for a whole submission.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`] beyond the capacity.
    pub fn record(&self, gpu: &Gpu, stage: &mut Stage, count: u32) -> Result<(), GpuError> {
        self.flags.check_range(0, count as usize)?;
        gpu.write(&self.count, 0, &[count])?;
        let chunks = count.div_ceil(CHUNK);
        stage.run(&self.passes[0], [chunks, 1, 1])?;
        stage.run(&self.passes[1], [count.div_ceil(BLOCK), 1, 1])?;
        stage.run(&self.passes[2], [1, 1, 1])?;
        stage.run(&self.passes[3], [chunks, 1, 1])
    }
}
