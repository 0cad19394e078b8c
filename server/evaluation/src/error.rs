//! The crate's errors.

use std::path::{Path, PathBuf};

/// Why a result cannot be scored. Result files that are merely absent are no error but listed as missing.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    /// The folder of results is none.
    #[error("{}: no such folder", .0.display())]
    NoResults(PathBuf),
    /// The truth or a result file cannot be read.
    #[error(transparent)]
    Recording(#[from] recording::RecordingError),
    /// The operating system refused to read.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The recording of the truth holds no stereo pair.
    #[error("the recording of the truth holds no stereo pair")]
    NoFrames,
    /// The recording's true mesh is damaged.
    #[error("truth_mesh.npz: {array}: {problem}")]
    TruthMesh {
        /// The array in the archive.
        array: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The recording's calibration cannot be rectified.
    #[error(transparent)]
    Geometry(#[from] geometry::GeometryError),
}

impl EvaluationError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        |source| Self::Io { path: path.to_path_buf(), source }
    }

    pub(crate) fn mesh(array: &str, problem: impl std::fmt::Display) -> Self {
        Self::TruthMesh { array: array.to_owned(), problem: problem.to_string() }
    }
}
