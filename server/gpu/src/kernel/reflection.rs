//! What a kernel's WGSL says of itself, read by naga.

use naga::{AddressSpace, Module, StorageAccess, TypeInner};

use super::Binding;

/// One binding of a kernel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BindingShape {
    /// Variable name.
    pub name: String,
    /// How the kernel uses it.
    pub kind: Binding,
    /// Size of an array's element (its stride), or of the whole value where it is no array.
    pub element_bytes: u32,
}

/// Entry point, bindings and workgroup of a kernel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KernelReflection {
    /// Name of the one compute entry point.
    pub entry_point: String,
    /// Workgroup size.
    pub workgroup: [u32; 3],
    /// Bindings `0..n` of group 0.
    pub bindings: Vec<BindingShape>,
    /// Sum of its workgroup variables; wgpu does not check it.
    pub workgroup_bytes: u64,
}

impl KernelReflection {
    /// Parses, validates and reflects complete WGSL.
    ///
    /// # Errors
    /// The compiler's message with its place, or what breaks the conventions of a kernel file.
    pub fn of(wgsl: &str) -> Result<Self, String> {
        let module = naga::front::wgsl::parse_str(wgsl).map_err(|error| error.emit_to_string(wgsl))?;
        let flags = naga::valid::ValidationFlags::all();
        naga::valid::Validator::new(flags, naga::valid::Capabilities::all())
            .validate(&module)
            .map_err(|error| error.emit_to_string(wgsl))?;
        let [entry] = module.entry_points.as_slice() else {
            return Err(format!("has {} entry points, a kernel file has one", module.entry_points.len()));
        };
        Ok(Self {
            entry_point: entry.name.clone(),
            workgroup: entry.workgroup_size,
            bindings: bindings(&module)?,
            workgroup_bytes: workgroup_bytes(&module),
        })
    }
}

fn bindings(module: &Module) -> Result<Vec<BindingShape>, String> {
    let mut numbered = Vec::new();
    for (_, variable) in module.global_variables.iter() {
        let Some(place) = &variable.binding else { continue };
        let name = variable.name.clone().unwrap_or_default();
        if place.group != 0 {
            return Err(format!("{name} is bound in group {}, kernels use group 0", place.group));
        }
        let kind = binding_kind(variable.space).ok_or_else(|| format!("{name} is not a buffer"))?;
        numbered.push((
            place.binding,
            BindingShape { name, kind, element_bytes: element_bytes(module, variable) },
        ));
    }
    numbered.sort_by_key(|(number, _)| *number);
    for (expected, (number, shape)) in numbered.iter().enumerate() {
        if *number as usize != expected {
            return Err(format!("{} has binding {number}, expected {expected}: no gaps", shape.name));
        }
    }
    Ok(numbered.into_iter().map(|(_, shape)| shape).collect())
}

fn binding_kind(space: AddressSpace) -> Option<Binding> {
    match space {
        AddressSpace::Uniform => Some(Binding::Uniform),
        AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => Some(Binding::ReadWrite),
        AddressSpace::Storage { .. } => Some(Binding::Read),
        _ => None,
    }
}

fn element_bytes(module: &Module, variable: &naga::GlobalVariable) -> u32 {
    match module.types[variable.ty].inner {
        TypeInner::Array { stride, .. } => stride,
        ref other => other.size(module.to_ctx()),
    }
}

fn workgroup_bytes(module: &Module) -> u64 {
    let shared =
        module.global_variables.iter().filter(|(_, variable)| variable.space == AddressSpace::WorkGroup);
    let size = |ty: naga::Handle<naga::Type>| u64::from(module.types[ty].inner.size(module.to_ctx()));
    shared.map(|(_, variable)| size(variable.ty).next_multiple_of(16)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bindings_strides_and_workgroup_memory_are_found() {
        let reflection = KernelReflection::of(
            "struct P { a: vec4<f32>, n: u32 }
             var<workgroup> tile: array<f32, 64>;
             @group(0) @binding(1) var<storage, read_write> points: array<vec3<f32>>;
             @group(0) @binding(0) var<uniform> p: P;
             @compute @workgroup_size(8, 4) fn go() { tile[0] = p.a.x; points[0].x = tile[0]; }",
        )
        .unwrap();
        assert_eq!(reflection.workgroup, [8, 4, 1]);
        assert_eq!(reflection.workgroup_bytes, 256);
        let shapes: Vec<_> = reflection.bindings.iter().map(|b| (b.kind, b.element_bytes)).collect();
        assert_eq!(shapes, [(Binding::Uniform, 32), (Binding::ReadWrite, 16)]);
    }

    #[test]
    fn a_gap_in_the_bindings_is_refused() {
        let wgsl = "@group(0) @binding(1) var<storage> a: array<u32>;
                    @compute @workgroup_size(1) fn go() { _ = a[0]; }";
        assert!(KernelReflection::of(wgsl).unwrap_err().contains("expected 0"));
    }

    #[test]
    fn a_compile_error_shows_its_place() {
        let error = KernelReflection::of("@compute @workgroup_size(1) fn go() { let x = y; }").unwrap_err();
        assert!(error.contains('y') && error.contains("wgsl:1:"), "{error}");
    }
}
