//! Every WGSL file of the workspace is valid and keeps to the conventions of a kernel file.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};

use gpu::{KernelReflection, resolve_imports};

/// The least that any adapter offers; wgpu does not check kernels against it.
const WORKGROUP_BYTES: u64 = 16 * 1024;
const WORKGROUP_INVOCATIONS: u32 = 256;
const STORAGE_BUFFERS: usize = 10;

fn kernel_files() -> Vec<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let skipped = |name: &std::ffi::OsStr| name == "target" || name == "node_modules" || name == ".git";
    let mut files: Vec<PathBuf> = walkdir::WalkDir::new(workspace)
        .into_iter()
        .filter_entry(|entry| !skipped(entry.file_name()))
        .map(|entry| entry.unwrap().into_path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "wgsl"))
        .filter(|path| !path.parent().is_some_and(|folder| folder.ends_with("gpu/src/shared")))
        .collect();
    files.sort();
    files
}

fn reflect(path: &Path) -> Result<KernelReflection, String> {
    let wgsl = std::fs::read_to_string(path).unwrap();
    resolve_imports(&wgsl).and_then(|wgsl| KernelReflection::of(&wgsl))
}

#[test]
fn every_wgsl_file_is_a_valid_kernel_named_like_its_file() {
    let files = kernel_files();
    assert!(files.len() >= 4, "found only {files:?}");
    for path in files {
        let reflection = reflect(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(Some(reflection.entry_point.as_str()), path.file_stem().and_then(|stem| stem.to_str()));
    }
}

#[test]
fn every_kernel_fits_the_poorest_adapter() {
    for path in kernel_files() {
        let Ok(reflection) = reflect(&path) else { continue };
        let invocations: u32 = reflection.workgroup.iter().product();
        let storage = reflection.bindings.iter().filter(|shape| shape.kind != gpu::Binding::Uniform).count();
        let name = path.display();
        assert!(
            reflection.workgroup_bytes <= WORKGROUP_BYTES,
            "{name}: {} bytes",
            reflection.workgroup_bytes
        );
        assert!(invocations <= WORKGROUP_INVOCATIONS, "{name}: {invocations} invocations");
        assert!(storage <= STORAGE_BUFFERS, "{name}: {storage} storage buffers");
    }
}
