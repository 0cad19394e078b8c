//! The crate's errors.

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// What can be wrong with recordings, data sets and result files.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refused to read or write.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is no MCAP file, or cannot be written as one.
    #[error("{}: {source}", .path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// Why.
        source: mcap::McapError,
    },
    /// A message that cannot be understood.
    #[error("{}: topic {topic}: {field}: {problem}", .path.display())]
    Message {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The field of the message.
        field: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A topic that is needed and not there.
    #[error(
        "{}: no message on topic {topic} (the file has {}); set recording.topics.{key} for other names",
        .path.display(), .present.join(", ")
    )]
    MissingTopic {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The configuration key that names it.
        key: &'static str,
        /// The topics that the file does have.
        present: Vec<String>,
    },
    /// A calibration that cannot be written, as it cannot be rectified.
    #[error("calibration: {0}")]
    Calibration(#[from] geometry::GeometryError),
    /// An image format that is not read.
    #[error("image format {0:?} is not read; jpeg, png, rgb8, bgr8 and mono8 are")]
    ImageFormat(String),
    /// An image of another size than the calibration's.
    #[error("the image is {}x{}, expected {}x{}", got.0, got.1, expected.0, expected.1)]
    ImageSize {
        /// Columns and rows expected.
        expected: (u32, u32),
        /// Columns and rows that the image's header claims.
        got: (u32, u32),
    },
    /// An image that is cut short or damaged.
    #[error("damaged {format} image of {bytes} bytes: {problem}")]
    ImageData {
        /// The image's format.
        format: &'static str,
        /// Its length.
        bytes: usize,
        /// What is wrong.
        problem: String,
    },
    /// A file of a data set, or a result file, that does not hold what it should.
    #[error("{}: {problem}", .path.display())]
    Input {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, with the line or value.
        problem: String,
    },
}

impl RecordingError {
    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        |source| Self::Io { path: path.to_path_buf(), source }
    }

    pub(crate) fn container(path: &Path) -> impl FnOnce(mcap::McapError) -> Self + '_ {
        |source| Self::Container { path: path.to_path_buf(), source }
    }

    pub(crate) fn input(path: &Path, problem: impl Display) -> Self {
        Self::Input { path: path.to_path_buf(), problem: problem.to_string() }
    }
}
