//! The GPU device, kernels, buffers, readback and timing.
//!
//! [`Gpu::open`] chooses an adapter and makes one device. A [`KernelDeclaration`] is compiled once into a
//! [`Kernel`], bound once to [`GpuBuffer`]s, and run inside the timed stages of a [`FrameRecorder`]: one frame is
//! one encoder, and nothing is read back before it has been submitted. Where a subscriber listens to [`PASSES`], every pass
//! that has run is told as an event, on the CPU's clock.

mod adapter;
mod alignment;
mod buffer;
mod device;
mod error;
mod frame;
mod kernel;
mod memory;
mod readback;
mod scan;
mod timing;

pub use adapter::{AdapterDescription, AdapterSelection, list_adapters};
pub use alignment::trace_epoch;
pub use buffer::{BufferKind, GpuBuffer};
pub use device::{Capabilities, Gpu, STORAGE_BUFFERS};
pub use error::GpuError;
pub use frame::{Flushed, FrameRecorder, Stage, Submitted};
pub use kernel::{
    Bindable, Binding, BoundKernel, Kernel, KernelDeclaration, KernelReflection, resolve_imports,
};
pub use memory::MemoryUse;
pub use readback::Readback;
pub use scan::PrefixSum;
pub use timing::{Clock, FrameTimes, PASSES, StageTime, StageTimer};
