//! What stops the command.

use std::path::{Path, PathBuf};

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum AccuracyError {
    /// `--only` with a name that is not known.
    #[error("there is no row {name:?}; there are {known}")]
    NoSuchRow {
        /// The name asked for.
        name: String,
        /// All names.
        known: String,
    },
    /// The configuration.
    #[error(transparent)]
    Config(#[from] mis_slam::config::SettingsError),
    /// A scene could not be simulated.
    #[error(transparent)]
    Simulated(#[from] mis_slam::simulated::SimulatedError),
    /// A recording or result file.
    #[error(transparent)]
    Recording(#[from] recording::RecordingError),
    /// A replay.
    #[error(transparent)]
    Replay(#[from] mis_slam::replay::ReplayError),
    /// The scores.
    #[error(transparent)]
    Evaluation(#[from] evaluation::EvaluationError),
    /// The figure.
    #[error("the figure {}: {problem}", .path.display())]
    Figure {
        /// Its file.
        path: PathBuf,
        /// What went wrong.
        problem: String,
    },
    /// A file or folder.
    #[error("{}: {source}", .path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl AccuracyError {
    /// Names the file in an error of the system.
    pub fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }
}
