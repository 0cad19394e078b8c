//! The end of a run: its journal sealed, its results written beside it.

use std::path::Path;

use recording::{RecordingConfig, RecordingError, RecordingReader, export};

use super::engine::EngineResults;
use super::journal::Journal;
use crate::replay::{ReplayError, files};
use crate::storage::{Run, Storage, StorageError};

/// What keeps a run's results from being written.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The journal, or the trajectory from it.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A result file.
    #[error(transparent)]
    Results(#[from] ReplayError),
    /// The run's directory.
    #[error(transparent)]
    Storage(#[from] StorageError),
}

/// Seals the journal, writes the results and hands the run over to the finished ones.
///
/// # Errors
/// The first [`ResultsError`]; everything else is written all the same.
pub fn finish(
    run: Run,
    journal: Option<Journal>,
    results: Option<&EngineResults>,
    (storage, recording): (&Storage, &RecordingConfig),
) -> Result<(), ResultsError> {
    let path = run.journal();
    let model = results.filter(|_| run.info().record).map_or(&[][..], |results| &results.model);
    let sealed = match journal {
        Some(journal) => journal.seal(model),
        None => Ok(()),
    };
    let trajectory = match path.exists() {
        true => write_trajectory(&path, &run.file("trajectory.tum"), recording),
        false => Ok(()),
    };
    let written = results.map_or(Ok(()), |results| files::write_results(&run.file(""), results));
    let moved = run.finish(storage);
    sealed?;
    trajectory?;
    written?;
    Ok(moved?)
}

/// The poses as they were published; a journal that ended early has those up to there.
fn write_trajectory(journal: &Path, to: &Path, config: &RecordingConfig) -> Result<(), RecordingError> {
    let poses = RecordingReader::open(journal, config)?.estimated_poses()?;
    export::write_tum(to, &poses)
}
