//! What a server keeps on disk: the journals of open sessions, what finished ones left behind, recordings to replay.
//!
//! Below `[storage] directory`: `open/<run>/` with `run.json` and `journal.mcap`; `finished/<run>/` with the results;
//! `recordings/<name>`. A run is one session with one calibration, named `<session>.<UTC time>`. A run is moved from
//! `open` to `finished` in one step, so that what is found below `open` at the start is what a crash left.

use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use protocol::SessionId;
use serde::{Deserialize, Serialize};

mod finished;
mod recordings;
mod run;

pub use finished::{FINISHED_FILES, FinishedRun, MODEL_FILE};
pub use recordings::{StoredRecording, Upload};
pub use run::{JOURNAL, RECORDING, Run};

/// Section `[storage]` of the configuration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StorageConfig {
    /// Where everything is kept; empty keeps nothing.
    pub directory: PathBuf,
    /// Keeps a recording of every session, asked for or not.
    pub record_all: bool,
    /// Finished sessions kept; the oldest are removed.
    pub finished_max: usize,
    /// Largest recording that may be uploaded.
    pub upload_max_mib: u64,
    /// Recordings stop, and uploads are refused, below this much free space.
    pub free_min_mib: u64,
    /// Pairs that a model lost with its GPU is rebuilt from, at most.
    pub rebuild_pairs_max: usize,
    /// After a crash at most this much of the end of a journal is worked through.
    pub recover_max_s: f64,
}

/// What went wrong with the disk.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", .path.display())]
pub struct StorageError {
    /// The file or directory.
    pub path: PathBuf,
    /// The system's reason.
    pub source: io::Error,
}

impl StorageError {
    fn at(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self { path, source }
    }
}

/// About one run, written when it starts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunInfo {
    /// The session.
    pub session: String,
    /// So that a cart may take the session over after a crash as before it.
    pub takeover_token: String,
    /// Whether the recording is kept when the run ends.
    pub record: bool,
    /// Whether the journal holds the pairs, so that the run can be recovered from it.
    pub inputs: bool,
}

/// The server's directory.
#[derive(Debug)]
pub struct Storage {
    config: StorageConfig,
}

impl Storage {
    /// Makes the directories; `None` where the configuration wants nothing kept.
    ///
    /// # Errors
    /// [`StorageError`] names the directory that cannot be made.
    pub fn open(config: &StorageConfig) -> Result<Option<Self>, StorageError> {
        if config.directory.as_os_str().is_empty() {
            return Ok(None);
        }
        let storage = Self { config: config.clone() };
        for part in [storage.open_runs(), storage.finished_runs(), storage.recordings_directory()] {
            std::fs::create_dir_all(&part).map_err(StorageError::at(&part))?;
        }
        Ok(Some(storage))
    }

    /// The options.
    pub fn config(&self) -> &StorageConfig {
        &self.config
    }

    fn open_runs(&self) -> PathBuf {
        self.config.directory.join("open")
    }

    fn finished_runs(&self) -> PathBuf {
        self.config.directory.join("finished")
    }

    fn recordings_directory(&self) -> PathBuf {
        self.config.directory.join("recordings")
    }

    /// Starts a run in a directory of its own.
    ///
    /// # Errors
    /// [`StorageError`].
    pub fn begin(&self, info: RunInfo) -> Result<Run, StorageError> {
        Run::begin(&self.open_runs(), &self.finished_runs(), info)
    }

    /// The runs that a crash left, oldest first; those without pairs in their journal are removed.
    ///
    /// # Errors
    /// [`StorageError`] where the directory cannot be read.
    pub fn left_open(&self) -> Result<Vec<Run>, StorageError> {
        let mut runs = Vec::new();
        for directory in directories(&self.open_runs())? {
            match Run::found(&directory) {
                Ok(run) if run.info().inputs => runs.push(run),
                Ok(run) => run.discard(),
                Err(error) => tracing::error!(%error, "a run that cannot be recovered is left where it is"),
            }
        }
        Ok(runs)
    }

    /// Fails below the free space that must be left.
    ///
    /// # Errors
    /// The system's, or one that says how little is free.
    pub fn check_room(&self) -> io::Result<()> {
        check_room(&self.config.directory, self.config.free_min_mib)
    }
}

/// Fails where less than `free_min_mib` is free at `path`.
///
/// # Errors
/// The system's, or one that says how little is free.
pub fn check_room(path: &Path, free_min_mib: u64) -> io::Result<()> {
    let free_mib = fs4::available_space(path)? >> 20;
    if free_mib >= free_min_mib {
        return Ok(());
    }
    let text = format!("{free_mib} MiB are free, less than storage.free_min_mib = {free_min_mib}");
    Err(io::Error::new(io::ErrorKind::StorageFull, text))
}

/// The directories in a directory, by name.
fn directories(parent: &Path) -> Result<Vec<PathBuf>, StorageError> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(parent).map_err(StorageError::at(parent))? {
        let entry = entry.map_err(StorageError::at(parent))?;
        if entry.file_type().map_err(StorageError::at(parent))?.is_dir() {
            found.push(entry.path());
        }
    }
    found.sort();
    Ok(found)
}

/// The name of a run that starts now: names of one session sort by time.
fn run_name(session: &SessionId, number: u32) -> String {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    format!("{session}.{}-{number}", since_epoch.as_millis())
}

/// A plain file name, which cannot leave its directory.
fn is_plain_name(name: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.');
    (1..=128).contains(&name.len()) && !name.starts_with('.') && name.bytes().all(allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_their_directory_are_not_plain() {
        for name in ["", ".", "..", "a/b", "../x", ".hidden", "a\\b", "ä.mcap", &"x".repeat(129)] {
            assert!(!is_plain_name(name), "{name:?}");
        }
        assert!(is_plain_name("liver_2-1.mcap"));
    }

    #[test]
    fn a_disk_without_room_is_told_with_its_figures() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_room(folder.path(), 0).is_ok());
        let error = check_room(folder.path(), u64::MAX).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert!(error.to_string().contains("free_min_mib"), "{error}");
    }
}
