//! One run: a session with one calibration, from its first pair to its results.

use std::path::{Path, PathBuf};

use protocol::SessionId;

use super::{RunInfo, Storage, StorageError, run_name};

/// The file that grows while a run is open.
pub const JOURNAL: &str = "journal.mcap";
/// The same file once the run has ended, where it is kept.
pub const RECORDING: &str = "recording.mcap";
/// The journal that a crash left, while it is being worked through.
const CRASHED: &str = "crashed.mcap";
const INFO: &str = "run.json";
/// Runs of one session that may start in one millisecond.
const NAMES_MAX: u32 = 100;

/// A run's directory.
#[derive(Debug)]
pub struct Run {
    directory: PathBuf,
    info: RunInfo,
}

impl Run {
    /// A directory in `parent` whose name none in `finished` has, where it goes in the end.
    pub(super) fn begin(parent: &Path, finished: &Path, info: RunInfo) -> Result<Self, StorageError> {
        let session: SessionId = info
            .session
            .parse()
            .map_err(|error| StorageError::at(parent)(std::io::Error::other(format!("{error}"))))?;
        let mut number = 0;
        let directory = loop {
            let name = run_name(&session, number);
            let directory = parent.join(&name);
            let made = if finished.join(&name).exists() {
                Err(std::io::ErrorKind::AlreadyExists.into())
            } else {
                std::fs::create_dir(&directory)
            };
            match made {
                Ok(()) => break directory,
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && number < NAMES_MAX => {
                    number += 1;
                }
                Err(error) => return Err(StorageError::at(&directory)(error)),
            }
        };
        let run = Self { directory, info };
        let text = serde_json::to_vec_pretty(&run.info).expect("texts and flags have a JSON form");
        let path = run.file(INFO);
        std::fs::write(&path, text).map_err(StorageError::at(&path))?;
        Ok(run)
    }

    /// A run that a crash left.
    pub(super) fn found(directory: &Path) -> Result<Self, StorageError> {
        let path = directory.join(INFO);
        let text = std::fs::read(&path).map_err(StorageError::at(&path))?;
        let info = serde_json::from_slice(&text).map_err(|error| StorageError::at(&path)(error.into()))?;
        Ok(Self { directory: directory.to_path_buf(), info })
    }

    /// What was written when it started.
    pub fn info(&self) -> &RunInfo {
        &self.info
    }

    /// A file of the run.
    pub fn file(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// Where the journal grows.
    pub fn journal(&self) -> PathBuf {
        self.file(JOURNAL)
    }

    /// Puts the journal that a crash left aside, so that a new one can be written while it is read. After a crash
    /// during that, the first one counts: it holds all that was ever taken.
    ///
    /// # Errors
    /// [`StorageError`].
    pub fn set_crashed_aside(&self) -> Result<PathBuf, StorageError> {
        let (journal, crashed) = (self.journal(), self.file(CRASHED));
        if !crashed.exists() {
            std::fs::rename(&journal, &crashed).map_err(StorageError::at(&journal))?;
        }
        Ok(crashed)
    }

    /// The run has ended: its journal becomes its recording, or goes, and its directory is moved to the finished ones.
    ///
    /// # Errors
    /// [`StorageError`]; what was written stays where it is.
    pub fn finish(self, storage: &Storage) -> Result<(), StorageError> {
        let journal = self.journal();
        if journal.exists() {
            let done = if self.info.record {
                std::fs::rename(&journal, self.file(RECORDING))
            } else {
                std::fs::remove_file(&journal)
            };
            done.map_err(StorageError::at(&journal))?;
        }
        storage.take_finished(&self.directory)
    }

    /// Removes all traces of it.
    pub fn discard(self) {
        if let Err(error) = std::fs::remove_dir_all(&self.directory) {
            tracing::warn!(path = %self.directory.display(), %error, "a run that is not needed stays");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::StorageConfig;

    fn storage(folder: &Path) -> Storage {
        let config = StorageConfig {
            directory: folder.to_path_buf(),
            record_all: false,
            finished_max: 2,
            upload_max_mib: 1,
            free_min_mib: 0,
            rebuild_pairs_max: 10,
            recover_max_s: 60.0,
        };
        Storage::open(&config).unwrap().expect("a directory was given")
    }

    fn info(record: bool, inputs: bool) -> RunInfo {
        RunInfo { session: "theatre-3".into(), takeover_token: "secret".into(), record, inputs }
    }

    #[test]
    fn a_run_that_ends_leaves_its_recording_only_where_it_was_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let storage = storage(folder.path());
        for record in [true, false] {
            let run = storage.begin(info(record, true)).unwrap();
            std::fs::write(run.journal(), b"pairs").unwrap();
            std::fs::write(run.file("report.json"), b"{}").unwrap();
            run.finish(&storage).unwrap();
            let newest = &storage.finished().unwrap()[0];
            assert_eq!(newest.files.contains(&RECORDING.to_owned()), record, "{newest:?}");
            assert_eq!(
                (newest.session.as_str(), newest.files.contains(&"report.json".to_owned())),
                ("theatre-3", true)
            );
        }
        assert!(storage.left_open().unwrap().is_empty());
    }

    #[test]
    fn the_oldest_finished_runs_make_room() {
        let folder = tempfile::tempdir().unwrap();
        let storage = storage(folder.path());
        let runs = [(); 3].map(|()| {
            storage.begin(info(false, true)).unwrap().finish(&storage).unwrap();
            storage.finished().unwrap()[0].run.clone()
        });
        let kept: Vec<String> = storage.finished().unwrap().into_iter().map(|run| run.run).collect();
        assert_eq!(kept, [runs[2].clone(), runs[1].clone()]);
    }

    #[test]
    fn a_crash_leaves_the_run_open_and_its_first_journal_counts() {
        let folder = tempfile::tempdir().unwrap();
        let storage = storage(folder.path());
        std::fs::write(storage.begin(info(false, true)).unwrap().journal(), b"first").unwrap();
        storage.begin(info(false, false)).unwrap();
        for _ in 0..2 {
            let [run] = &storage.left_open().unwrap()[..] else { panic!("one run holds pairs") };
            assert_eq!(run.info(), &info(false, true));
            let crashed = run.set_crashed_aside().unwrap();
            assert_eq!(std::fs::read(crashed).unwrap(), b"first");
            std::fs::write(run.journal(), b"second").unwrap();
        }
    }
}
