//! Typed buffers.

use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::Pod;

use crate::GpuError;
use crate::memory::Allocation;

/// What a buffer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferKind {
    /// An array that kernels read and write.
    Storage,
    /// One small value that kernels read.
    Uniform,
}

impl BufferKind {
    pub(crate) fn usages(self) -> wgpu::BufferUsages {
        use wgpu::BufferUsages as U;
        match self {
            Self::Storage => U::STORAGE | U::INDIRECT | U::COPY_SRC | U::COPY_DST,
            Self::Uniform => U::UNIFORM | U::COPY_DST,
        }
    }
}

/// A handle to `len` elements of `T` on the device, which are freed, and struck out of the memory account, with the
/// last handle.
#[derive(Clone, Debug)]
pub struct GpuBuffer<T> {
    raw: wgpu::Buffer,
    _allocation: Arc<Allocation>,
    label: Arc<str>,
    len: usize,
    kind: BufferKind,
    element: PhantomData<fn() -> T>,
}

impl<T: Pod> GpuBuffer<T> {
    pub(crate) fn new(
        raw: wgpu::Buffer,
        allocation: Allocation,
        label: &str,
        len: usize,
        kind: BufferKind,
    ) -> Self {
        Self { raw, _allocation: Arc::new(allocation), label: label.into(), len, kind, element: PhantomData }
    }

    /// Elements.
    #[allow(clippy::len_without_is_empty, reason = "a buffer has at least one element")]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Name in errors and captures.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// What the buffer is for.
    pub fn kind(&self) -> BufferKind {
        self.kind
    }

    /// The same memory, read as elements of another type of the same size.
    pub fn cast<U: Pod>(&self) -> GpuBuffer<U> {
        const { assert!(size_of::<T>() == size_of::<U>(), "elements of one size") };
        GpuBuffer {
            raw: self.raw.clone(),
            _allocation: self._allocation.clone(),
            label: self.label.clone(),
            len: self.len,
            kind: self.kind,
            element: PhantomData,
        }
    }

    /// The buffer itself, for drawing from it.
    pub fn raw(&self) -> &wgpu::Buffer {
        &self.raw
    }

    pub(crate) fn check_range(&self, start: usize, len: usize) -> Result<(), GpuError> {
        match start.checked_add(len) {
            Some(end) if end <= self.len => Ok(()),
            end => Err(GpuError::OutOfRange {
                label: self.label.to_string(),
                start,
                end: end.unwrap_or(usize::MAX),
                len: self.len,
            }),
        }
    }
}
