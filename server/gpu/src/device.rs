//! The device: opened once, shared by all sessions.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use bytemuck::Pod;

use crate::adapter::{self, AdapterDescription, AdapterSelection};
use crate::buffer::{BufferKind, GpuBuffer};
use crate::memory::{Allocation, Ledger, MemoryUse};
use crate::{Flushed, GpuError, Kernel, KernelDeclaration, Readback};

/// Optional abilities of the device; where one is missing a plain path is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capabilities {
    /// Stages are timed by the GPU's own clock.
    pub timestamps: bool,
    /// Kernels may use subgroup operations.
    pub subgroups: bool,
    /// Kernels may take immediates.
    pub immediates: bool,
}

/// Storage buffers that a kernel may bind. Drivers of graphics cards offer 64 and more, Mesa's software one 32, Metal 31.
pub const STORAGE_BUFFERS: u32 = 20;

/// An open device with its queue. Share it in an `Arc`.
#[derive(Debug)]
pub struct Gpu {
    instance: wgpu::Instance,
    adapter: wgpu::Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    description: AdapterDescription,
    capabilities: Capabilities,
    ledger: Arc<Ledger>,
    lost: Arc<OnceLock<String>>,
    uncaptured: Arc<Mutex<Option<GpuError>>>,
    kernels: Mutex<BTreeMap<(&'static str, &'static str), Kernel>>,
    poison: bool,
}

impl Gpu {
    /// Opens the selected adapter with all limits that it offers.
    ///
    /// # Errors
    /// [`GpuError::NoVulkan`] with the install command, [`GpuError::AdapterNotFound`],
    /// [`GpuError::TooFewBuffers`], [`GpuError::NoDevice`].
    pub fn open(selection: &AdapterSelection) -> Result<Self, GpuError> {
        let (instance, adapter) = adapter::choose(selection)?;
        let description = AdapterDescription::of(&adapter);
        require_buffers(&description.name, &adapter.limits())?;
        let wanted = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::SUBGROUP | wgpu::Features::IMMEDIATES;
        let features = adapter.features() & wanted;
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("mis-slam"),
            required_features: features,
            required_limits: adapter.limits(),
            memory_hints: wgpu::MemoryHints::Performance,
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            trace: wgpu::Trace::Off,
        });
        let (device, queue) = pollster::block_on(request).map_err(|error| GpuError::NoDevice {
            adapter: description.name.clone(),
            reason: error.to_string(),
        })?;
        let gpu = Self {
            capabilities: Capabilities {
                timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
                subgroups: features.contains(wgpu::Features::SUBGROUP),
                immediates: features.contains(wgpu::Features::IMMEDIATES),
            },
            instance,
            adapter,
            device,
            queue,
            description,
            ledger: Arc::default(),
            lost: Arc::default(),
            uncaptured: Arc::default(),
            kernels: Mutex::default(),
            poison: false,
        };
        gpu.watch();
        Ok(gpu)
    }

    /// For tests: fresh buffers are filled with `0xFF` bytes (NaN, `u32::MAX`) in place of zeros, so that a kernel
    /// which reads what nobody wrote is found out.
    #[must_use]
    pub fn with_poisoned_buffers(self) -> Self {
        Self { poison: true, ..self }
    }

    /// For tests: takes the plain paths, as on a device without any of the optional abilities.
    #[must_use]
    pub fn with_plain_paths(self) -> Self {
        Self { capabilities: Capabilities { timestamps: false, subgroups: false, immediates: false }, ..self }
    }

    /// The adapter this device was opened on.
    pub fn description(&self) -> &AdapterDescription {
        &self.description
    }

    /// Where windows get their surfaces from.
    pub fn instance(&self) -> &wgpu::Instance {
        &self.instance
    }

    /// The adapter itself, to be asked what a surface takes.
    pub fn adapter(&self) -> &wgpu::Adapter {
        &self.adapter
    }

    /// The device itself, for drawing; kernels need only [`Gpu::kernel`].
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The queue itself, for drawing.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// What this device can do beyond the plain.
    pub fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    /// Bytes in this device's buffers.
    pub fn memory_use(&self) -> MemoryUse {
        self.ledger.memory_use()
    }

    /// Whether the device has been lost and must be opened again.
    pub fn is_lost(&self) -> bool {
        self.lost.get().is_some()
    }

    /// Gives the device up, as a failing driver does; for drills and tests of what follows.
    pub fn lose(&self, reason: &str) {
        self.lost.get_or_init(|| reason.to_owned());
        self.device.destroy();
    }

    /// Reports a lost device, or the first error since the last call that no caller received.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`], [`GpuError::OutOfMemory`], [`GpuError::Validation`].
    pub fn health(&self) -> Result<(), GpuError> {
        if let Some(reason) = self.lost.get() {
            return Err(GpuError::DeviceLost { reason: reason.clone() });
        }
        let pending = self.uncaptured.lock().unwrap_or_else(PoisonError::into_inner).take();
        pending.map_or(Ok(()), Err)
    }

    /// A storage buffer of `len` elements (at least one), zeroed unless poisoned.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] before anything is allocated, [`GpuError::OutOfMemory`].
    pub fn storage<T: Pod>(&self, label: &str, len: usize) -> Result<GpuBuffer<T>, GpuError> {
        self.buffer(label, len, BufferKind::Storage)
    }

    /// A storage buffer that holds `data`.
    ///
    /// # Errors
    /// As [`Gpu::storage`].
    pub fn storage_from<T: Pod>(&self, label: &str, data: &[T]) -> Result<GpuBuffer<T>, GpuError> {
        let buffer = self.storage(label, data.len())?;
        self.write(&buffer, 0, data)?;
        Ok(buffer)
    }

    /// A uniform buffer of one value.
    ///
    /// # Errors
    /// As [`Gpu::storage`].
    pub fn uniform<T: Pod>(&self, label: &str, value: &T) -> Result<GpuBuffer<T>, GpuError> {
        let buffer = self.buffer(label, 1, BufferKind::Uniform)?;
        self.write(&buffer, 0, std::slice::from_ref(value))?;
        Ok(buffer)
    }

    /// Writes `data` from element `start` on; it is there when the next submission runs.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`].
    pub fn write<T: Pod>(&self, buffer: &GpuBuffer<T>, start: usize, data: &[T]) -> Result<(), GpuError> {
        buffer.check_range(start, data.len())?;
        let offset = (start * size_of::<T>()) as u64;
        self.queue.write_buffer(buffer.raw(), offset, bytemuck::cast_slice(data));
        Ok(())
    }

    /// Reads a whole buffer; waits for all submitted work. Not for use inside a frame.
    ///
    /// # Errors
    /// As [`Readback::read`].
    pub fn read<T: Pod>(&self, buffer: &GpuBuffer<T>) -> Result<Vec<T>, GpuError> {
        self.read_range(buffer, 0, buffer.len())
    }

    /// Reads `len` elements from `start` on; waits for all submitted work. Not for use inside a frame.
    ///
    /// # Errors
    /// [`GpuError::OutOfRange`], else as [`Readback::read`].
    pub fn read_range<T: Pod>(
        &self,
        buffer: &GpuBuffer<T>,
        start: usize,
        len: usize,
    ) -> Result<Vec<T>, GpuError> {
        buffer.check_range(start, len)?;
        if len == 0 {
            return Ok(Vec::new());
        }
        let readback = Readback::new(self, buffer.label(), len)?;
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        readback.record(&mut encoder, buffer, start);
        self.queue.submit([encoder.finish()]);
        readback.read(self)
    }

    /// The compiled kernel, from this device's cache where it has been compiled before.
    ///
    /// # Errors
    /// As [`Kernel::compile`].
    pub fn kernel(&self, declaration: &KernelDeclaration) -> Result<Kernel, GpuError> {
        let key = (declaration.name, declaration.wgsl);
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = kernels.get(&key) {
            return Ok(kernel.clone());
        }
        let kernel = Kernel::compile(self, declaration)?;
        kernels.insert(key, kernel.clone());
        Ok(kernel)
    }

    /// Runs `action` and returns the first error the driver raised in it.
    pub(crate) fn checked<T>(
        &self,
        what: &str,
        bytes: u64,
        action: impl FnOnce() -> T,
    ) -> Result<T, GpuError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = action();
        let raised = [internal, validation, memory].map(|scope| pollster::block_on(scope.pop()));
        match raised.into_iter().flatten().next() {
            None => Ok(result),
            Some(wgpu::Error::OutOfMemory { .. }) => Err(self.out_of_memory(what, bytes)),
            Some(error) => Err(GpuError::Validation(format!("{what}: {error}"))),
        }
    }

    /// Waits until everything submitted so far has run.
    ///
    /// # Errors
    /// As [`Gpu::health`].
    pub fn wait(&self) -> Result<(), GpuError> {
        self.wait_for(None)
    }

    /// Waits until `part` has run, or else everything submitted so far.
    pub(crate) fn wait_for(&self, part: Option<Flushed>) -> Result<(), GpuError> {
        let submission_index = part.map(|part| part.0);
        let polled = self.device.poll(wgpu::PollType::Wait { submission_index, timeout: None });
        self.health()?;
        polled.map(|_| ()).map_err(|error| GpuError::DeviceLost { reason: error.to_string() })
    }

    pub(crate) fn raw_buffer(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<(wgpu::Buffer, Allocation), GpuError> {
        let fill = self.poison && usage.contains(wgpu::BufferUsages::STORAGE);
        let raw = self.checked(label, bytes, || {
            let raw = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: fill,
            });
            if fill {
                if let Ok(mut view) = raw.get_mapped_range_mut(..) {
                    view.copy_from_slice(&vec![0xFF; bytes as usize]);
                }
                raw.unmap();
            }
            raw
        })?;
        Ok((raw, Allocation::new(&self.ledger, bytes)))
    }

    fn buffer<T: Pod>(&self, label: &str, len: usize, kind: BufferKind) -> Result<GpuBuffer<T>, GpuError> {
        let len = len.max(1);
        let limits = self.device.limits();
        let limit_bytes = match kind {
            BufferKind::Storage => limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            BufferKind::Uniform => limits.max_uniform_buffer_binding_size,
        };
        let bytes = (len as u64).saturating_mul(size_of::<T>() as u64).next_multiple_of(4);
        if bytes > limit_bytes {
            return Err(GpuError::BufferTooLarge { label: label.to_owned(), bytes, limit_bytes });
        }
        let (raw, allocation) = self.raw_buffer(label, bytes, kind.usages())?;
        Ok(GpuBuffer::new(raw, allocation, label, len, kind))
    }

    fn out_of_memory(&self, what: &str, bytes: u64) -> GpuError {
        GpuError::OutOfMemory { what: what.to_owned(), bytes, in_use_bytes: self.memory_use().current_bytes }
    }

    /// Keeps what the driver reports outside any call: a lost device, and errors that no scope caught.
    fn watch(&self) {
        let lost = self.lost.clone();
        self.device.set_device_lost_callback(move |reason, message| {
            lost.get_or_init(|| format!("{reason:?}: {message}"));
        });
        let (uncaptured, ledger) = (self.uncaptured.clone(), self.ledger.clone());
        self.device.on_uncaptured_error(Arc::new(move |error| {
            let error = match error {
                wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory {
                    what: "a submission".to_owned(),
                    bytes: 0,
                    in_use_bytes: ledger.memory_use().current_bytes,
                },
                other => GpuError::Validation(other.to_string()),
            };
            let mut slot = uncaptured.lock().unwrap_or_else(PoisonError::into_inner);
            slot.get_or_insert(error);
        }));
    }
}

fn require_buffers(adapter: &str, limits: &wgpu::Limits) -> Result<(), GpuError> {
    let offered = limits.max_storage_buffers_per_shader_stage;
    if offered >= STORAGE_BUFFERS {
        return Ok(());
    }
    Err(GpuError::TooFewBuffers { adapter: adapter.to_owned(), offered, needed: STORAGE_BUFFERS })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_adapter_with_too_few_buffers_for_the_kernels_is_refused_with_its_figure() {
        let limits = wgpu::Limits { max_storage_buffers_per_shader_stage: 10, ..wgpu::Limits::default() };
        let refused = require_buffers("SwiftShader", &limits).unwrap_err().to_string();
        assert_eq!(refused, "adapter \"SwiftShader\" offers 10 storage buffers per kernel; 20 are needed");
        let enough = wgpu::Limits { max_storage_buffers_per_shader_stage: STORAGE_BUFFERS, ..limits };
        assert_eq!(require_buffers("SwiftShader", &enough), Ok(()));
    }
}
