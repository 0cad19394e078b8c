//! The file: an array of the Trace Event Format's records.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::Serialize;

/// A trace that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("trace {}: {source}", .file.display())]
pub struct TraceError {
    file: PathBuf,
    source: std::io::Error,
}

/// Who did something: one line of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Track {
    pid: u32,
    tid: u32,
}

impl Track {
    /// The GPU's queue.
    pub const GPU: Self = Self { pid: 2, tid: 1 };

    /// A thread of ours, by the number that the trace gave it.
    pub fn thread(number: u32) -> Self {
        Self { pid: 1, tid: number }
    }
}

/// Something that took time.
pub(super) struct Done<'a> {
    pub name: &'a str,
    pub track: Track,
    /// Since the epoch.
    pub begin_ns: u64,
    pub end_ns: u64,
    pub frame: Option<u64>,
}

/// A trace that is being written. Readers take it without its last bracket too, so one that a crash cut short is still of use.
#[derive(Debug)]
pub struct TraceFile {
    path: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    out: BufWriter<File>,
    failed: Option<std::io::Error>,
    finished: bool,
}

#[derive(Serialize)]
struct Complete<'a> {
    ph: &'static str,
    name: &'a str,
    #[serde(flatten)]
    track: Track,
    /// Microseconds.
    ts: f64,
    dur: f64,
    args: Arguments,
}

#[derive(Serialize)]
struct Arguments {
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<u64>,
}

#[derive(Serialize)]
struct Name<'a> {
    ph: &'static str,
    /// `process_name` or `thread_name`.
    name: &'static str,
    #[serde(flatten)]
    track: Track,
    args: NameArguments<'a>,
}

#[derive(Serialize)]
struct NameArguments<'a> {
    name: &'a str,
}

impl TraceFile {
    /// An empty trace; replaces a file that is there.
    ///
    /// # Errors
    /// [`TraceError`].
    pub fn create(path: &Path) -> Result<Self, TraceError> {
        let begun = File::create(path).and_then(|file| {
            let mut out = BufWriter::new(file);
            out.write_all(b"[")?;
            Ok(out)
        });
        let out = begun.map_err(|source| TraceError { file: path.to_path_buf(), source })?;
        let state = Mutex::new(State { out, failed: None, finished: false });
        let trace = Self { path: path.to_path_buf(), state };
        trace.name("process_name", Track::thread(1), "mis-slam", "");
        trace.name("process_name", Track::GPU, "GPU", ",");
        trace.name("thread_name", Track::GPU, "queue", ",");
        Ok(trace)
    }

    pub(super) fn name_thread(&self, track: Track, name: &str) {
        self.name("thread_name", track, name, ",");
    }

    fn name(&self, what: &'static str, track: Track, name: &str, before: &str) {
        self.write(&Name { ph: "M", name: what, track, args: NameArguments { name } }, before);
    }

    pub(super) fn add(&self, done: &Done) {
        let us = |ns: u64| ns as f64 * 1e-3;
        let record = Complete {
            ph: "X",
            name: done.name,
            track: done.track,
            ts: us(done.begin_ns),
            dur: us(done.end_ns.saturating_sub(done.begin_ns)),
            args: Arguments { frame: done.frame },
        };
        self.write(&record, ",");
    }

    /// A file that fails once is left as it is; [`TraceFile::finish`] says so.
    fn write(&self, record: &impl Serialize, before: &str) {
        let mut state = self.state();
        if state.failed.is_some() || state.finished {
            return;
        }
        let text = serde_json::to_string(record).expect("a record has string keys and finite numbers");
        if let Err(error) = writeln!(state.out, "{before}{text}") {
            state.failed = Some(error);
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Completes the file; what is traced later is left out.
    ///
    /// # Errors
    /// [`TraceError`] where anything could not be written.
    pub fn finish(&self) -> Result<(), TraceError> {
        let mut state = self.state();
        state.finished = true;
        let ended = match state.failed.take() {
            Some(error) => Err(error),
            None => state.out.write_all(b"]\n").and_then(|()| state.out.flush()),
        };
        ended.map_err(|source| TraceError { file: self.path.clone(), source })
    }
}
