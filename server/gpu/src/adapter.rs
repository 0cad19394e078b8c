//! Which GPU to use.

use serde::{Deserialize, Serialize};

use crate::GpuError;

/// The environment variable that overrides the configured adapter.
const ADAPTER_VARIABLE: &str = "MIS_SLAM_ADAPTER";

/// The `[gpu]` section: which adapter to open.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdapterSelection {
    /// Part of the adapter's name (any case), its index in [`list_adapters`], or empty for the most capable one.
    pub adapter: String,
}

impl AdapterSelection {
    /// The same selection, overridden by the environment variable `MIS_SLAM_ADAPTER` where it is set.
    #[must_use]
    pub fn with_environment(self) -> Self {
        match std::env::var(ADAPTER_VARIABLE) {
            Ok(adapter) if !adapter.is_empty() => Self { adapter },
            _ => self,
        }
    }
}

/// What a report says about an adapter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AdapterDescription {
    /// Product name, e.g. `llvmpipe (LLVM 15.0.6, 256 bits)`.
    pub name: String,
    /// Driver name and version.
    pub driver: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Largest storage buffer binding.
    pub max_binding_bytes: u64,
    /// Storage buffers one kernel may bind.
    pub max_storage_buffers: u32,
    /// Workgroup memory of one kernel.
    pub max_workgroup_bytes: u32,
    /// Invocations in one workgroup.
    pub max_workgroup_invocations: u32,
    /// Smallest and largest subgroup.
    pub subgroup_size: [u32; 2],
}

impl AdapterDescription {
    pub(crate) fn of(adapter: &wgpu::Adapter) -> Self {
        let info = adapter.get_info();
        let limits = adapter.limits();
        Self {
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            kind: kind_name(info.device_type),
            max_binding_bytes: limits.max_storage_buffer_binding_size,
            max_storage_buffers: limits.max_storage_buffers_per_shader_stage,
            max_workgroup_bytes: limits.max_compute_workgroup_storage_size,
            max_workgroup_invocations: limits.max_compute_invocations_per_workgroup,
            subgroup_size: [info.subgroup_min_size, info.subgroup_max_size],
            name: info.name,
        }
    }
}

/// All Vulkan adapters in index order, empty where no driver is installed.
pub fn list_adapters() -> Vec<AdapterDescription> {
    enumerate(&instance()).iter().map(AdapterDescription::of).collect()
}

/// The adapter that the selection means, and the instance that it is of.
pub(crate) fn choose(selection: &AdapterSelection) -> Result<(wgpu::Instance, wgpu::Adapter), GpuError> {
    let instance = instance();
    let adapters = enumerate(&instance);
    if adapters.is_empty() {
        return Err(GpuError::NoVulkan);
    }
    let names: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
    let kinds: Vec<wgpu::DeviceType> =
        adapters.iter().map(|adapter| adapter.get_info().device_type).collect();
    let index = choose_index(&selection.adapter, &names, &kinds)
        .ok_or_else(|| GpuError::AdapterNotFound { wanted: selection.adapter.clone(), present: names })?;
    Ok((instance, adapters[index].clone()))
}

fn instance() -> wgpu::Instance {
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::PRIMARY,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

fn enumerate(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY))
}

/// An index, else the first name that contains `wanted`; with nothing wanted the most capable kind, first of equals.
fn choose_index(wanted: &str, names: &[String], kinds: &[wgpu::DeviceType]) -> Option<usize> {
    if wanted.is_empty() {
        return (0..kinds.len()).min_by_key(|&index| preference(kinds[index]));
    }
    if let Ok(index) = wanted.parse::<usize>() {
        return (index < names.len()).then_some(index);
    }
    let wanted = wanted.to_lowercase();
    names.iter().position(|name| name.to_lowercase().contains(&wanted))
}

fn preference(kind: wgpu::DeviceType) -> u32 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::VirtualGpu => 1,
        wgpu::DeviceType::IntegratedGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn kind_name(kind: wgpu::DeviceType) -> &'static str {
    match kind {
        wgpu::DeviceType::DiscreteGpu => "discrete",
        wgpu::DeviceType::VirtualGpu => "virtual",
        wgpu::DeviceType::IntegratedGpu => "integrated",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu};

    fn present() -> (Vec<String>, [wgpu::DeviceType; 3]) {
        let names = ["llvmpipe (LLVM 15)", "NVIDIA H100", "Intel UHD"].map(str::to_owned).to_vec();
        (names, [Cpu, DiscreteGpu, IntegratedGpu])
    }

    #[test]
    fn a_discrete_gpu_is_preferred_and_software_comes_last() {
        let (names, kinds) = present();
        assert_eq!(choose_index("", &names, &kinds), Some(1));
        assert_eq!(choose_index("", &names, &[Cpu, Cpu, IntegratedGpu]), Some(2));
        assert_eq!(choose_index("", &names[..1], &kinds[..1]), Some(0));
    }

    #[test]
    fn an_adapter_is_named_by_substring_or_index() {
        let (names, kinds) = present();
        assert_eq!(choose_index("LLVMpipe", &names, &kinds), Some(0));
        assert_eq!(choose_index("2", &names, &kinds), Some(2));
        assert_eq!(choose_index("3", &names, &kinds), None);
        assert_eq!(choose_index("radeon", &names, &kinds), None);
    }
}
