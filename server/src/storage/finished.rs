//! What finished sessions left behind.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;

use super::run::RECORDING;
use super::{Storage, StorageError, directories, is_plain_name};

/// The final model.
pub const MODEL_FILE: &str = "model.ply";

/// The files that a finished run may have and that are handed out, with their media types.
pub const FINISHED_FILES: [(&str, &str); 5] = [
    (MODEL_FILE, "application/octet-stream"),
    ("model.png", "image/png"),
    ("trajectory.tum", "text/plain"),
    ("report.json", "application/json"),
    (RECORDING, "application/octet-stream"),
];

/// A finished run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FinishedRun {
    /// Its name, `<session>.<time>`.
    pub run: String,
    /// The session that it was.
    pub session: String,
    /// When it ended, milliseconds since 1970.
    pub ended_ms: u64,
    /// Its files.
    pub files: Vec<String>,
}

impl Storage {
    /// All finished runs, newest first.
    ///
    /// # Errors
    /// [`StorageError`] where the directory cannot be read.
    pub fn finished(&self) -> Result<Vec<FinishedRun>, StorageError> {
        let mut runs: Vec<FinishedRun> =
            directories(&self.finished_runs())?.iter().filter_map(|directory| describe(directory)).collect();
        runs.sort_by(|a, b| (b.ended_ms, &b.run).cmp(&(a.ended_ms, &a.run)));
        Ok(runs)
    }

    /// One of them.
    pub fn finished_run(&self, run: &str) -> Option<FinishedRun> {
        is_plain_name(run).then(|| describe(&self.finished_runs().join(run))).flatten()
    }

    /// A file of one of them, where it is one that is handed out.
    pub fn finished_file(&self, run: &str, file: &str) -> Option<(PathBuf, &'static str)> {
        let (name, media_type) = FINISHED_FILES.into_iter().find(|(name, _)| *name == file)?;
        let path = self.finished_runs().join(is_plain_name(run).then_some(run)?).join(name);
        path.is_file().then_some((path, media_type))
    }

    /// Removes one of them; whether it was there.
    ///
    /// # Errors
    /// [`StorageError`].
    pub fn remove_finished(&self, run: &str) -> Result<bool, StorageError> {
        if self.finished_run(run).is_none() {
            return Ok(false);
        }
        let directory = self.finished_runs().join(run);
        std::fs::remove_dir_all(&directory).map_err(StorageError::at(&directory))?;
        Ok(true)
    }

    /// Takes a run's directory in; the oldest ones over the limit go.
    pub(super) fn take_finished(&self, directory: &Path) -> Result<(), StorageError> {
        let name = directory.file_name().unwrap_or_default();
        std::fs::rename(directory, self.finished_runs().join(name)).map_err(StorageError::at(directory))?;
        for old in self.finished()?.into_iter().skip(self.config.finished_max) {
            self.remove_finished(&old.run)?;
        }
        Ok(())
    }
}

fn describe(directory: &Path) -> Option<FinishedRun> {
    let run = directory.file_name()?.to_str()?.to_owned();
    let (session, _) = run.split_once('.')?;
    let modified = directory.metadata().ok()?.modified().ok()?;
    let ended_ms = modified.duration_since(std::time::UNIX_EPOCH).ok()?.as_millis() as u64;
    let present = |name: &&str| directory.join(name).is_file();
    let files = FINISHED_FILES.iter().map(|(name, _)| *name).filter(present).map(str::to_owned).collect();
    Some(FinishedRun { session: session.to_owned(), run, ended_ms, files })
}
