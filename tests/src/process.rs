//! Runs the workspace's own programs.

use std::path::PathBuf;
use std::process::{Command, Output};

/// A program of this workspace, built with the same profile as the tests.
///
/// # Panics
/// Where it was not built: `cargo build --workspace --bins` (config/test.sh does that).
pub fn program(name: &str) -> Command {
    let path = profile_directory().join(name);
    assert!(path.exists(), "{} is not built; run `cargo build --workspace --bins` first", path.display());
    Command::new(path)
}

fn profile_directory() -> PathBuf {
    let test = std::env::current_exe().expect("a running test has a path");
    let deps = test.parent().expect("a test lies in deps/");
    deps.parent().expect("deps/ lies in the profile's directory").to_path_buf()
}

/// Runs to the end.
///
/// # Panics
/// Where the program fails, with what it printed.
pub fn run(command: Command) -> Output {
    let output = run_any(command);
    assert!(output.status.success(), "{}", described(&output));
    output
}

/// Runs to the end, whatever comes of it.
pub fn run_any(mut command: Command) -> Output {
    command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"))
}

/// Exit status and everything printed.
pub fn described(output: &Output) -> String {
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    format!("{}\n--- stdout\n{out}\n--- stderr\n{err}", output.status)
}
