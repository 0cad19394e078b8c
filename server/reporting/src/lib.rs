//! One self-contained page, and the same figures as JSON, from the directories that replays wrote.
//!
//! A page shows only what its run wrote and what its recording holds; what is missing is listed as missing, with what
//! would bring it. A file that is there and cannot be read refuses the run by name.

mod axes;
mod chart;
mod colors;
mod error;
mod figures;
mod frames;
mod page;
mod paper;
mod picture;
mod planes;
mod run;
mod truth;

use std::path::{Path, PathBuf};

use recording::RecordingConfig;

pub use error::ReportingError;
use page::Page;
use run::Run;
use truth::Known;

/// A run to report on.
#[derive(Clone, Debug)]
pub struct RunSource {
    /// The directory that a replay wrote.
    pub directory: PathBuf,
    /// The recording that it replayed; where `None`, the one that the run names itself, if that is still there.
    pub recording: Option<PathBuf>,
}

/// The page and its figures, ready to be written.
#[derive(Clone, Debug)]
pub struct RenderedReport {
    /// One HTML document with its pictures in it.
    pub html: String,
    /// The figures of all runs.
    pub json: String,
}

/// Reports on runs, in their order; `progress` is told runs done.
///
/// # Errors
/// [`ReportingError`] names the file of a run or recording that cannot be read.
pub fn report(
    sources: &[RunSource],
    config: &RecordingConfig,
    progress: &mut dyn FnMut(usize),
) -> Result<RenderedReport, ReportingError> {
    let mut page = Page::default();
    for (done, source) in sources.iter().enumerate() {
        let run = Run::read(&source.directory)?;
        let known = Known::of(&run, source.recording.as_deref(), config)?;
        page.add(&run, &known)?;
        progress(done + 1);
    }
    Ok(RenderedReport { html: page.html()?, json: page.json() })
}

/// The name that people know a file or directory by.
fn name_of(path: &Path) -> String {
    // `.` and `x/..` have names too, once resolved.
    let resolved = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    resolved.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
