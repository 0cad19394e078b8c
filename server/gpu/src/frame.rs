//! One frame's GPU work: stages recorded into one encoder, submitted once.

use std::ops::Range;
use std::time::Instant;

use bytemuck::Pod;

use crate::alignment::since_epoch_ns;
use crate::timing::{PASSES, sum_by_name, tell_passes};
use crate::{BoundKernel, Clock, FrameTimes, Gpu, GpuBuffer, GpuError, StageTimer};

/// Records the stages of one frame.
pub struct FrameRecorder<'a> {
    gpu: &'a Gpu,
    timer: &'a StageTimer,
    encoder: wgpu::CommandEncoder,
    names: Vec<&'static str>,
    alone: Vec<(Instant, Instant)>,
    handed_over: Option<Instant>,
    dispatches: u32,
}

/// The kernels of one stage, recorded in order; each sees what the one before it wrote.
pub struct Stage<'a> {
    pass: wgpu::ComputePass<'a>,
    limit: u32,
    dispatches: u32,
}

/// A part of a frame that the GPU already works on.
#[derive(Clone, Debug)]
pub struct Flushed(pub(crate) wgpu::SubmissionIndex);

/// A submitted frame whose times have not been read yet.
#[must_use = "the timer can serve the next frame only after this one's times are collected"]
pub struct Submitted<'a> {
    gpu: &'a Gpu,
    timer: &'a StageTimer,
    names: Vec<&'static str>,
    /// When each stage was run by itself, where the GPU does not tell.
    alone: Vec<(Instant, Instant)>,
    /// When the GPU could begin.
    handed_over: Instant,
    dispatches: u32,
}

impl<'a> FrameRecorder<'a> {
    /// Starts a frame; `timer` must have no frame in flight.
    pub fn begin(gpu: &'a Gpu, timer: &'a StageTimer) -> Self {
        let encoder = new_encoder(gpu);
        let (names, alone) = (Vec::new(), Vec::new());
        Self { gpu, timer, encoder, names, alone, handed_over: None, dispatches: 0 }
    }

    /// Records one timed stage. Several stages of one name are summed in the report.
    ///
    /// # Errors
    /// [`GpuError::TooManyStages`], and whatever `record` returns.
    pub fn stage<E: From<GpuError>>(
        &mut self,
        name: &'static str,
        record: impl FnOnce(&mut Stage) -> Result<(), E>,
    ) -> Result<(), E> {
        let index = self.names.len() as u32;
        if index >= self.timer.capacity() {
            return Err(GpuError::TooManyStages { limit: self.timer.capacity() }.into());
        }
        let started = Instant::now();
        let pass = self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(name),
            timestamp_writes: self.timer.writes(index),
        });
        let limit = self.gpu.device.limits().max_compute_workgroups_per_dimension;
        let mut stage = Stage { pass, limit, dispatches: 0 };
        let recorded = record(&mut stage);
        self.dispatches += stage.dispatches;
        drop(stage);
        self.names.push(name);
        recorded?;
        if self.timer.clock() == Clock::Cpu {
            self.run_now(started)?;
        }
        Ok(())
    }

    /// Zeroes a buffer.
    pub fn clear<T: Pod>(&mut self, buffer: &GpuBuffer<T>) {
        self.encoder.clear_buffer(buffer.raw(), 0, None);
    }

    /// Zeroes the elements of `range`.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`].
    pub fn clear_range<T: Pod>(
        &mut self,
        buffer: &GpuBuffer<T>,
        range: Range<usize>,
    ) -> Result<(), GpuError> {
        buffer.check_range(range.start, range.len())?;
        let size = size_of::<T>() as u64;
        let bytes = Some(range.len() as u64 * size);
        self.encoder.clear_buffer(buffer.raw(), range.start as u64 * size, bytes);
        Ok(())
    }

    /// Copies the first `len` elements of `source`.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`] where either buffer is shorter.
    pub fn copy<T: Pod>(
        &mut self,
        source: &GpuBuffer<T>,
        target: &GpuBuffer<T>,
        len: usize,
    ) -> Result<(), GpuError> {
        source.check_range(0, len)?;
        target.check_range(0, len)?;
        let bytes = (len * size_of::<T>()) as u64;
        self.encoder.copy_buffer_to_buffer(source.raw(), 0, target.raw(), 0, bytes);
        Ok(())
    }

    /// The device that the frame is for.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// Hands what has been recorded so far to the GPU and returns at once; the frame goes on. Only for a stage that
    /// needs the CPU in the middle of it.
    pub fn flush(&mut self) -> Flushed {
        let encoder = std::mem::replace(&mut self.encoder, new_encoder(self.gpu));
        self.handed_over.get_or_insert_with(Instant::now);
        Flushed(self.gpu.queue.submit([encoder.finish()]))
    }

    /// Hands the frame to the GPU and returns at once.
    pub fn submit(mut self) -> Submitted<'a> {
        if self.timer.clock() == Clock::Gpu {
            self.timer.resolve(&mut self.encoder, self.names.len() as u32);
        }
        let handed_over = *self.handed_over.get_or_insert_with(Instant::now);
        self.gpu.queue.submit([self.encoder.finish()]);
        Submitted {
            gpu: self.gpu,
            timer: self.timer,
            names: self.names,
            alone: self.alone,
            handed_over,
            dispatches: self.dispatches,
        }
    }

    pub(crate) fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }

    /// Without GPU time stamps the only honest time of a stage is that of running it alone.
    fn run_now(&mut self, started: Instant) -> Result<(), GpuError> {
        let encoder = std::mem::replace(&mut self.encoder, new_encoder(self.gpu));
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait()?;
        self.alone.push((started, Instant::now()));
        Ok(())
    }
}

impl Stage<'_> {
    /// Runs `kernel` over at least `invocations` along x, y and z; the kernel guards the excess.
    ///
    /// # Errors
    /// [`GpuError::DispatchTooLarge`].
    pub fn run(&mut self, kernel: &BoundKernel, invocations: [u32; 3]) -> Result<(), GpuError> {
        let size = kernel.workgroup();
        let groups = [0, 1, 2].map(|axis| invocations[axis].div_ceil(size[axis]));
        let largest = groups.into_iter().fold(0, u32::max);
        if largest > self.limit {
            let kernel = kernel.name().to_owned();
            return Err(GpuError::DispatchTooLarge { kernel, workgroups: largest, limit: self.limit });
        }
        if groups.contains(&0) {
            return Ok(());
        }
        self.pass.set_pipeline(kernel.pipeline());
        self.pass.set_bind_group(0, kernel.bind_group(), &[]);
        self.pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
        self.dispatches += 1;
        Ok(())
    }

    /// Runs `kernel` over as many workgroups along x, y and z as the first three elements of `groups` say when it comes to
    /// run; the kernel guards the excess.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`] where `groups` is shorter.
    pub fn run_indirect(&mut self, kernel: &BoundKernel, groups: &GpuBuffer<u32>) -> Result<(), GpuError> {
        groups.check_range(0, 3)?;
        self.pass.set_pipeline(kernel.pipeline());
        self.pass.set_bind_group(0, kernel.bind_group(), &[]);
        self.pass.dispatch_workgroups_indirect(groups.raw(), 0);
        self.dispatches += 1;
        Ok(())
    }
}

impl Submitted<'_> {
    /// Waits for the frame and returns the time of each of its stages.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`] and whatever the driver raised in the frame.
    pub fn collect(self) -> Result<FrameTimes, GpuError> {
        let clock = self.timer.clock();
        let stamps = self.timer.read(self.gpu, self.names.len() as u32)?;
        let seen = Instant::now();
        let ms = match clock {
            Clock::Gpu => stamps.ms(),
            Clock::Cpu => self.alone.iter().map(|(begin, end)| (*end - *begin).as_secs_f64() * 1e3).collect(),
        };
        if tracing::enabled!(target: PASSES, tracing::Level::TRACE) {
            let ns = since_epoch_ns;
            let placed = match clock {
                Clock::Gpu => self.timer.place(&stamps, ns(self.handed_over)..ns(seen)),
                Clock::Cpu => self.alone.iter().map(|&(begin, end)| ns(begin)..ns(end)).collect(),
            };
            tell_passes(&self.names, &placed);
        }
        self.gpu.health()?;
        Ok(FrameTimes { stages: sum_by_name(&self.names, &ms, clock), dispatches: self.dispatches })
    }
}

fn new_encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") })
}
