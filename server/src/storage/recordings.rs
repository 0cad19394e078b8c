//! Recordings that can be replayed: a directory of MCAP files, filled by hand or by upload.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use schemars::JsonSchema;
use serde::Serialize;

use super::{Storage, StorageError, is_plain_name};

static NEXT_UPLOAD: AtomicU64 = AtomicU64::new(0);

/// A stored recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StoredRecording {
    /// Its file name.
    pub recording: String,
    /// Its size.
    pub bytes: u64,
}

impl Storage {
    /// All recordings, by name.
    ///
    /// # Errors
    /// [`StorageError`] where the directory cannot be read.
    pub fn recordings(&self) -> Result<Vec<StoredRecording>, StorageError> {
        let directory = self.recordings_directory();
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&directory).map_err(StorageError::at(&directory))? {
            let entry = entry.map_err(StorageError::at(&directory))?;
            if let Some(recording) = describe(&entry.path()) {
                found.push(recording);
            }
        }
        found.sort_by(|a, b| a.recording.cmp(&b.recording));
        Ok(found)
    }

    /// The file of a recording, where there is one of that name.
    pub fn recording(&self, name: &str) -> Option<PathBuf> {
        let path = self.recordings_directory().join(is_recording_name(name).then_some(name)?);
        path.is_file().then_some(path)
    }

    /// Removes a recording; whether it was there.
    ///
    /// # Errors
    /// [`StorageError`].
    pub fn remove_recording(&self, name: &str) -> Result<bool, StorageError> {
        let Some(path) = self.recording(name) else { return Ok(false) };
        std::fs::remove_file(&path).map_err(StorageError::at(&path))?;
        Ok(true)
    }

    /// A file for an upload, seen by nobody until it is kept; `None` for a name that no recording may have.
    pub fn upload(&self, name: &str) -> Option<Upload> {
        let directory = self.recordings_directory();
        let number = NEXT_UPLOAD.fetch_add(1, Ordering::Relaxed);
        let to = directory.join(is_recording_name(name).then_some(name)?);
        Some(Upload { part: directory.join(format!(".{name}.{number}.part")), to })
    }
}

fn is_recording_name(name: &str) -> bool {
    is_plain_name(name) && Path::new(name).extension().is_some_and(|extension| extension == "mcap")
}

fn describe(path: &Path) -> Option<StoredRecording> {
    let recording = path.file_name()?.to_str()?.to_owned();
    let metadata = path.metadata().ok()?;
    (metadata.is_file() && is_recording_name(&recording))
        .then_some(StoredRecording { recording, bytes: metadata.len() })
}

/// A recording that is being uploaded; removed unless it is kept.
#[derive(Debug)]
pub struct Upload {
    part: PathBuf,
    to: PathBuf,
}

impl Upload {
    /// Where its bytes go.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Gives it its name, in the place of an older one of that name.
    ///
    /// # Errors
    /// The system's.
    pub fn keep(self) -> io::Result<()> {
        std::fs::rename(&self.part, &self.to)
    }
}

impl Drop for Upload {
    fn drop(&mut self) {
        // Kept, or never written: then there is nothing.
        let _ = std::fs::remove_file(&self.part);
    }
}
