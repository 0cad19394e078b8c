//! Results on their way back to the CPU, outside frames.

use std::marker::PhantomData;
use std::time::Duration;

use bytemuck::Pod;

use crate::memory::Allocation;
use crate::{Flushed, FrameRecorder, Gpu, GpuBuffer, GpuError};

/// How long a finished readback may take to be announced by another thread.
const CALLBACK_TIMEOUT: Duration = Duration::from_secs(10);

/// A staging buffer for `len` elements: filled by a frame, read after its submission, then used again.
#[derive(Debug)]
pub struct Readback<T> {
    staging: wgpu::Buffer,
    _allocation: Allocation,
    len: usize,
    element: PhantomData<fn() -> T>,
}

impl<T: Pod> Readback<T> {
    /// Room for `len` elements.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`].
    pub fn new(gpu: &Gpu, label: &str, len: usize) -> Result<Self, GpuError> {
        let bytes = ((len * size_of::<T>()) as u64).next_multiple_of(4).max(4);
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let (staging, allocation) = gpu.raw_buffer(label, bytes, usage)?;
        Ok(Self { staging, _allocation: allocation, len, element: PhantomData })
    }

    /// Records the copy of `source`'s elements from `start` on; fails at submission where they do not exist.
    pub fn fetch(&self, frame: &mut FrameRecorder, source: &GpuBuffer<T>, start: usize) {
        self.record(frame.encoder(), source, start);
    }

    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder, source: &GpuBuffer<T>, start: usize) {
        let offset = (start * size_of::<T>()) as u64;
        encoder.copy_buffer_to_buffer(source.raw(), offset, &self.staging, 0, self.staging.size());
    }

    /// What the last submitted copy brought; waits for it.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] and whatever the driver has raised since it was last asked.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<T>, GpuError> {
        self.take(gpu, None)
    }

    /// What the copy recorded before `part` brought; waits for no later work.
    ///
    /// # Errors
    /// As [`Readback::read`].
    pub fn read_after(&self, gpu: &Gpu, part: Flushed) -> Result<Vec<T>, GpuError> {
        self.take(gpu, Some(part))
    }

    fn take(&self, gpu: &Gpu, part: Option<Flushed>) -> Result<Vec<T>, GpuError> {
        let bytes = map_bytes(gpu, &self.staging, part)?;
        let mut elements = vec![T::zeroed(); self.len];
        let target: &mut [u8] = bytemuck::cast_slice_mut(&mut elements);
        let len = target.len();
        target.copy_from_slice(&bytes[..len]);
        Ok(elements)
    }
}

/// Maps a staging buffer once `part`, or else all submitted work, has run; copies it out and unmaps it.
pub(crate) fn map_bytes(
    gpu: &Gpu,
    staging: &wgpu::Buffer,
    part: Option<Flushed>,
) -> Result<Vec<u8>, GpuError> {
    gpu.health()?;
    let (sender, receiver) = std::sync::mpsc::sync_channel(1);
    staging.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver outlives the poll below; if that failed, nobody wants the result.
        let _ = sender.try_send(result);
    });
    gpu.wait_for(part)?;
    let lost = |reason: String| GpuError::DeviceLost { reason };
    // Where several threads wait on one device, the one that polled first runs the callbacks of all.
    let mapped = receiver
        .recv_timeout(CALLBACK_TIMEOUT)
        .map_err(|error| lost(format!("a readback never came: {error}")))?;
    mapped.map_err(|error| lost(error.to_string()))?;
    let view = staging.get_mapped_range(..).map_err(|error| lost(error.to_string()))?;
    let bytes = view.to_vec();
    drop(view);
    staging.unmap();
    Ok(bytes)
}
