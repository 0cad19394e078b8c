//! The crate's errors.

use std::path::{Path, PathBuf};

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportingError {
    /// The directory holds no run.
    #[error("{}: no such file; a report is made of what `mis-slam replay --out DIR` wrote", .0.display())]
    NoRun(PathBuf),
    /// The operating system refused to read.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file of a run does not hold what it should.
    #[error("{}: {problem}", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A recording, or a result file with a reader of its own.
    #[error(transparent)]
    Recording(#[from] recording::RecordingError),
    /// The run cannot be scored.
    #[error("{}: {source}", .directory.display())]
    Evaluation {
        /// The run.
        directory: PathBuf,
        /// Why.
        source: evaluation::EvaluationError,
    },
    /// A plot could not be drawn.
    #[error("plot of {what}: {problem}")]
    Plot {
        /// What it would have shown.
        what: &'static str,
        /// Why.
        problem: String,
    },
    /// The page could not be put together.
    #[error(transparent)]
    Page(#[from] askama::Error),
}

impl ReportingError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        |source| Self::Io { path: path.to_path_buf(), source }
    }

    pub(crate) fn damaged(path: &Path, problem: impl std::fmt::Display) -> Self {
        Self::Damaged { path: path.to_path_buf(), problem: problem.to_string() }
    }

    pub(crate) fn evaluation(directory: &Path) -> impl Fn(evaluation::EvaluationError) -> Self + '_ {
        |source| Self::Evaluation { directory: directory.to_path_buf(), source }
    }
}
