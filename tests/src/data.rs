//! Recordings that tests work on.

use std::path::{Path, PathBuf};

use crate::process;

/// The workspace's root.
pub fn workspace() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().expect("the tests package lies in the workspace").to_path_buf()
}

/// A file or folder of the shared research data; `None`, said aloud, where this machine has none.
pub fn shared_data(relative: &str) -> Option<PathBuf> {
    let path = workspace().join("../shared/data").join(relative);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not on this machine", path.display());
    None
}

/// The Python with the public packages of `tests/compat/requirements.txt`; `None`, said aloud, where there is none.
pub fn python() -> Option<PathBuf> {
    let named = std::env::var_os("MIS_SLAM_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or_else(|| workspace().join("target/python/bin/python"));
    if python.exists() {
        return Some(python);
    }
    eprintln!("skipped: {} is not there; config/setup.sh --test installs it", python.display());
    None
}

/// Simulates a small rigid scene into `directory/NAME.mcap` with the real command.
pub fn simulate(directory: &Path, name: &str, arguments: &[&str]) -> PathBuf {
    let path = directory.join(name).with_extension("mcap");
    let mut command = process::program("mis-slam");
    command.args(["simulate", "liver", "-o"]).arg(&path).args(arguments);
    process::run(command);
    path
}
