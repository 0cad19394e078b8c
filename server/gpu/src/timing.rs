//! How long each stage of a frame took, and when.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use crate::alignment::Alignment;
use crate::memory::Allocation;
use crate::readback::map_bytes;
use crate::{Gpu, GpuError};

/// Target of the events, one for each pass, that tell a trace what the GPU did: `pass`, its name; `begin_ns` and `end_ns`, since
/// [`trace_epoch`](crate::trace_epoch).
pub const PASSES: &str = "gpu::passes";

/// Which clock a stage was timed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Clock {
    /// The GPU's time stamps around the stage.
    Gpu,
    /// Wall time on the CPU; on a GPU without time stamps each stage is then submitted and awaited by itself.
    Cpu,
}

impl Clock {
    /// `gpu` or `cpu`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }
}

/// One stage of one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// Stage name.
    pub name: &'static str,
    /// Milliseconds; passes of one name are summed.
    pub ms: f64,
    /// Clock.
    pub clock: Clock,
}

/// The stages of one frame in order of first appearance.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTimes {
    /// Time per stage name.
    pub stages: Vec<StageTime>,
    /// Kernel dispatches recorded.
    pub dispatches: u32,
}

/// Time stamp queries for the stages of one frame at a time, used again by each frame.
#[derive(Debug)]
pub struct StageTimer {
    queries: Option<Queries>,
    capacity: u32,
}

#[derive(Debug)]
struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
    _allocations: [Allocation; 2],
    ns_per_tick: f64,
    alignment: Mutex<Alignment>,
}

/// What the queries of one submitted frame tell.
pub(crate) struct PassTimes {
    /// Begin and end of each pass, in the GPU's ticks.
    ticks: Vec<u64>,
    ns_per_tick: f64,
}

impl PassTimes {
    /// Milliseconds of each pass.
    pub fn ms(&self) -> Vec<f64> {
        let to_ms = |pair: &[u64]| pair[1].saturating_sub(pair[0]) as f64 * self.ns_per_tick * 1e-6;
        self.ticks.chunks_exact(2).map(to_ms).collect()
    }
}

impl StageTimer {
    /// A timer for at most `capacity` passes a frame.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`].
    pub fn new(gpu: &Gpu, capacity: u32) -> Result<Self, GpuError> {
        let queries = gpu.capabilities().timestamps.then(|| Queries::new(gpu, capacity)).transpose()?;
        Ok(Self { queries, capacity })
    }

    pub(crate) fn capacity(&self) -> u32 {
        self.capacity
    }

    pub(crate) fn clock(&self) -> Clock {
        if self.queries.is_some() { Clock::Gpu } else { Clock::Cpu }
    }

    /// The queries around pass number `pass`.
    pub(crate) fn writes(&self, pass: u32) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.queries.as_ref().map(|queries| wgpu::ComputePassTimestampWrites {
            query_set: &queries.set,
            beginning_of_pass_write_index: Some(2 * pass),
            end_of_pass_write_index: Some(2 * pass + 1),
        })
    }

    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, passes: u32) {
        let Some(queries) = &self.queries else { return };
        if passes > 0 {
            encoder.resolve_query_set(&queries.set, 0..2 * passes, &queries.resolved, 0);
            let bytes = u64::from(passes) * 16;
            encoder.copy_buffer_to_buffer(&queries.resolved, 0, &queries.staging, 0, bytes);
        }
    }

    /// The times of the submitted frame's passes; none without the GPU's time stamps.
    pub(crate) fn read(&self, gpu: &Gpu, passes: u32) -> Result<PassTimes, GpuError> {
        let Some(queries) = &self.queries else {
            return Ok(PassTimes { ticks: Vec::new(), ns_per_tick: 0.0 });
        };
        let bytes = map_bytes(gpu, &queries.staging, None)?;
        let ticks = bytemuck::pod_collect_to_vec(&bytes[..passes as usize * 16]);
        Ok(PassTimes { ticks, ns_per_tick: queries.ns_per_tick })
    }

    /// Where the passes lie on the CPU's clock, nanoseconds since the epoch, within the time from the frame's hand-over until now.
    pub(crate) fn place(&self, times: &PassTimes, window_ns: Range<u64>) -> Vec<Range<u64>> {
        let Some(queries) = &self.queries else { return Vec::new() };
        let mut alignment = queries.alignment.lock().unwrap_or_else(PoisonError::into_inner);
        alignment.place(&times.ticks, times.ns_per_tick, window_ns)
    }
}

/// Tells whoever listens when each pass ran.
pub(crate) fn tell_passes(names: &[&'static str], placed_ns: &[Range<u64>]) {
    for (&pass, placed) in names.iter().zip(placed_ns) {
        tracing::trace!(target: PASSES, pass, begin_ns = placed.start, end_ns = placed.end);
    }
}

impl Queries {
    fn new(gpu: &Gpu, capacity: u32) -> Result<Self, GpuError> {
        use wgpu::BufferUsages as U;
        let bytes = u64::from(capacity) * 16;
        let (resolved, first) = gpu.raw_buffer("time stamps", bytes, U::QUERY_RESOLVE | U::COPY_SRC)?;
        let (staging, second) = gpu.raw_buffer("time stamps read", bytes, U::MAP_READ | U::COPY_DST)?;
        let set = gpu.checked("time stamps", 0, || {
            gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("time stamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * capacity,
            })
        })?;
        let ns_per_tick = f64::from(gpu.queue.get_timestamp_period());
        let alignment = Mutex::default();
        Ok(Self { set, resolved, staging, _allocations: [first, second], ns_per_tick, alignment })
    }
}

/// Sums passes of one name, in order of first appearance.
pub(crate) fn sum_by_name(names: &[&'static str], ms: &[f64], clock: Clock) -> Vec<StageTime> {
    let mut stages: Vec<StageTime> = Vec::new();
    for (&name, &ms) in names.iter().zip(ms) {
        match stages.iter_mut().find(|stage| stage.name == name) {
            Some(stage) => stage.ms += ms,
            None => stages.push(StageTime { name, ms, clock }),
        }
    }
    stages
}
