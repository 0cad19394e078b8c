//! A kernel joined to its buffers.

use bytemuck::Pod;

use super::{Binding, BindingShape, Kernel};
use crate::{BufferKind, Gpu, GpuBuffer, GpuError};

/// A buffer of any element type, as a kernel sees it.
pub trait Bindable {
    /// The buffer.
    fn raw_buffer(&self) -> &wgpu::Buffer;
    /// Size of one element on the CPU.
    fn element_bytes(&self) -> usize;
    /// What the buffer is for.
    fn buffer_kind(&self) -> BufferKind;
    /// Name for errors.
    fn buffer_label(&self) -> &str;
}

impl<T: Pod> Bindable for GpuBuffer<T> {
    fn raw_buffer(&self) -> &wgpu::Buffer {
        self.raw()
    }

    fn element_bytes(&self) -> usize {
        size_of::<T>()
    }

    fn buffer_kind(&self) -> BufferKind {
        self.kind()
    }

    fn buffer_label(&self) -> &str {
        self.label()
    }
}

/// A kernel with its buffers, ready to run in any frame. It keeps the buffers' memory alive.
#[derive(Clone, Debug)]
pub struct BoundKernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    bind_group: wgpu::BindGroup,
    workgroup: [u32; 3],
}

impl Kernel {
    /// Binds `buffers` to bindings `0..n`.
    ///
    /// # Errors
    /// [`GpuError::Kernel`] where number, kind or element size differ from the WGSL.
    pub fn bind(&self, gpu: &Gpu, buffers: &[&dyn Bindable]) -> Result<BoundKernel, GpuError> {
        let error = |reason: String| GpuError::Kernel { kernel: self.name.to_owned(), reason };
        let shapes = &self.reflection.bindings;
        if shapes.len() != buffers.len() {
            return Err(error(format!("has {} bindings, got {} buffers", shapes.len(), buffers.len())));
        }
        for (shape, buffer) in shapes.iter().zip(buffers) {
            check(shape, *buffer).map_err(error)?;
        }
        let entries: Vec<_> = (0..).zip(buffers).map(|(binding, buffer)| entry(binding, *buffer)).collect();
        let bind_group = gpu.checked(self.name, 0, || {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.name),
                layout: &self.layout,
                entries: &entries,
            })
        })?;
        Ok(BoundKernel {
            name: self.name,
            pipeline: self.pipeline.clone(),
            bind_group,
            workgroup: self.reflection.workgroup,
        })
    }
}

fn entry(binding: u32, buffer: &dyn Bindable) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.raw_buffer().as_entire_binding() }
}

fn check(shape: &BindingShape, buffer: &dyn Bindable) -> Result<(), String> {
    let (name, label) = (&shape.name, buffer.buffer_label());
    if (shape.kind == Binding::Uniform) != (buffer.buffer_kind() == BufferKind::Uniform) {
        return Err(format!("{name} is {:?}, buffer {label} is {:?}", shape.kind, buffer.buffer_kind()));
    }
    if shape.element_bytes as usize != buffer.element_bytes() {
        let (wgsl, rust) = (shape.element_bytes, buffer.element_bytes());
        return Err(format!("an element of {name} has {wgsl} bytes, of buffer {label} {rust}"));
    }
    Ok(())
}

impl BoundKernel {
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    pub(crate) fn pipeline(&self) -> &wgpu::ComputePipeline {
        &self.pipeline
    }

    pub(crate) fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    pub(crate) fn workgroup(&self) -> [u32; 3] {
        self.workgroup
    }
}
