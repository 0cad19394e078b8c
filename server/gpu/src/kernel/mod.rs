//! Kernels: declared in one line, checked by reflection, compiled and bound once.
//!
//! A kernel is one WGSL file with one compute entry point and bindings `0..n` of group 0. What a declaration says
//! of it is checked against the WGSL when it is compiled, and the buffers against both when they are bound.

mod bind;
mod imports;
mod reflection;

pub use bind::{Bindable, BoundKernel};
pub use imports::resolve_imports;
pub use reflection::{BindingShape, KernelReflection};

use crate::{Gpu, GpuError};

/// How a kernel uses a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
}

/// One line per kernel: its name, its WGSL and what it binds.
#[derive(Clone, Copy, Debug)]
pub struct KernelDeclaration {
    /// Name of the kernel and of its entry point.
    pub name: &'static str,
    /// The WGSL file, before its imports are resolved.
    pub wgsl: &'static str,
    /// Kind of each binding of group 0, in order.
    pub bindings: &'static [Binding],
}

impl KernelDeclaration {
    /// Declares the kernel `name` of the file `wgsl`.
    pub const fn new(name: &'static str, wgsl: &'static str, bindings: &'static [Binding]) -> Self {
        Self { name, wgsl, bindings }
    }

    /// The complete WGSL and what it says of itself, checked against this declaration.
    ///
    /// # Errors
    /// [`GpuError::Kernel`] with the place in the file.
    pub fn reflect(&self) -> Result<(String, KernelReflection), GpuError> {
        let wgsl = resolve_imports(self.wgsl).map_err(|reason| self.error(reason))?;
        let reflection = KernelReflection::of(&wgsl).map_err(|reason| self.error(reason))?;
        if reflection.entry_point != self.name {
            return Err(self.error(format!("its entry point is \"{}\"", reflection.entry_point)));
        }
        let found: Vec<Binding> = reflection.bindings.iter().map(|shape| shape.kind).collect();
        if found != self.bindings {
            return Err(self.error(format!("declared bindings {:?}, in its WGSL {found:?}", self.bindings)));
        }
        Ok((wgsl, reflection))
    }

    fn error(&self, reason: String) -> GpuError {
        GpuError::Kernel { kernel: self.name.to_owned(), reason }
    }
}

/// A compiled kernel.
#[derive(Clone, Debug)]
pub struct Kernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    reflection: KernelReflection,
}

impl Kernel {
    /// Compiles a kernel for this device.
    ///
    /// # Errors
    /// [`GpuError::Kernel`] where the WGSL is invalid, differs from its declaration, or asks for more than the
    /// adapter has.
    pub fn compile(gpu: &Gpu, declaration: &KernelDeclaration) -> Result<Self, GpuError> {
        let (wgsl, reflection) = declaration.reflect()?;
        check_limits(gpu, declaration, &reflection)?;
        let name = declaration.name;
        let (pipeline, layout) = gpu
            .checked(name, 0, || build(gpu, name, wgsl, &reflection))
            .map_err(|error| declaration.error(error.to_string()))?;
        Ok(Self { name, pipeline, layout, reflection })
    }

    /// What its WGSL says.
    pub fn reflection(&self) -> &KernelReflection {
        &self.reflection
    }
}

fn check_limits(
    gpu: &Gpu,
    declaration: &KernelDeclaration,
    reflection: &KernelReflection,
) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let storage = declaration.bindings.iter().filter(|&&kind| kind != Binding::Uniform).count() as u64;
    let invocations = reflection.workgroup.iter().map(|&size| u64::from(size)).product();
    let needs = [
        ("storage buffers", storage, limits.max_storage_buffers_per_shader_stage),
        ("bytes of workgroup memory", reflection.workgroup_bytes, limits.max_compute_workgroup_storage_size),
        ("invocations per workgroup", invocations, limits.max_compute_invocations_per_workgroup),
    ];
    for (what, needed, offered) in needs {
        if needed > u64::from(offered) {
            return Err(declaration.error(format!("needs {needed} {what}, this adapter offers {offered}")));
        }
    }
    Ok(())
}

fn build(
    gpu: &Gpu,
    name: &str,
    wgsl: String,
    reflection: &KernelReflection,
) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
    let entries: Vec<_> = reflection.bindings.iter().enumerate().map(layout_entry).collect();
    let layout = gpu
        .device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries });
    let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some(name),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    (pipeline, layout)
}

fn layout_entry((binding, shape): (usize, &BindingShape)) -> wgpu::BindGroupLayoutEntry {
    let ty = match shape.kind {
        Binding::Uniform => wgpu::BufferBindingType::Uniform,
        Binding::Read => wgpu::BufferBindingType::Storage { read_only: true },
        Binding::ReadWrite => wgpu::BufferBindingType::Storage { read_only: false },
    };
    wgpu::BindGroupLayoutEntry {
        binding: binding as u32,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}
