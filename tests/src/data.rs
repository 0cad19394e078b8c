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

/// Simulates a small rigid scene into `directory/NAME.mcap` with the real command.
pub fn simulate(directory: &Path, name: &str, arguments: &[&str]) -> PathBuf {
    let path = directory.join(name).with_extension("mcap");
    let mut command = process::program("mis-slam");
    command.args(["simulate", "liver", "-o"]).arg(&path).args(arguments);
    process::run(command);
    path
}
