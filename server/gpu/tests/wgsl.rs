//! Every WGSL file of the workspace is valid and keeps to the conventions of a kernel file.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::path::{Path, PathBuf};

use gpu::{KernelReflection, STORAGE_BUFFERS, resolve_imports};

/// The least that any adapter offers; wgpu does not check kernels against it.
const WORKGROUP_BYTES: u64 = 16 * 1024;
const WORKGROUP_INVOCATIONS: u32 = 256;

/// All WGSL files but those of `shared/`, which every kernel file can import by name.
fn wgsl_files() -> Vec<PathBuf> {
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

/// The files with an entry point, each with the text of those files of its folder, or of one around it, that have none.
fn kernels() -> Vec<(PathBuf, Vec<String>)> {
    let text = |path: &PathBuf| std::fs::read_to_string(path).unwrap();
    let (kernels, libraries): (Vec<_>, Vec<_>) =
        wgsl_files().into_iter().partition(|path| text(path).contains("@compute"));
    let beside = |kernel: &Path| {
        let around = |library: &&PathBuf| library.parent().is_some_and(|folder| kernel.starts_with(folder));
        libraries.iter().filter(around).map(text).collect()
    };
    kernels.into_iter().map(|path| (path.clone(), beside(&path))).collect()
}

/// A kernel file is valid by itself or together with some of the libraries beside it.
fn reflect(path: &Path, libraries: &[String]) -> Result<KernelReflection, String> {
    let own = resolve_imports(&std::fs::read_to_string(path).unwrap())?;
    let mut outcome = KernelReflection::of(&own);
    for subset in 1..1u32 << libraries.len() {
        if outcome.is_ok() {
            break;
        }
        let chosen = libraries.iter().enumerate().filter(|(i, _)| subset & (1 << i) != 0);
        outcome = KernelReflection::of(&chosen.fold(own.clone(), |text, (_, library)| text + library));
    }
    outcome
}

#[test]
fn every_wgsl_file_is_a_valid_kernel_named_like_its_file() {
    let files = kernels();
    assert!(files.len() >= 4, "found only {files:?}");
    for (path, libraries) in files {
        let reflection =
            reflect(&path, &libraries).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert_eq!(Some(reflection.entry_point.as_str()), path.file_stem().and_then(|stem| stem.to_str()));
    }
}

#[test]
fn every_kernel_fits_the_poorest_adapter() {
    for (path, libraries) in kernels() {
        let Ok(reflection) = reflect(&path, &libraries) else { continue };
        let invocations: u32 = reflection.workgroup.iter().product();
        let storage = reflection.bindings.iter().filter(|shape| shape.kind != gpu::Binding::Uniform).count();
        let name = path.display();
        assert!(
            reflection.workgroup_bytes <= WORKGROUP_BYTES,
            "{name}: {} bytes",
            reflection.workgroup_bytes
        );
        assert!(invocations <= WORKGROUP_INVOCATIONS, "{name}: {invocations} invocations");
        assert!(storage <= STORAGE_BUFFERS as usize, "{name}: {storage} storage buffers");
    }
}
