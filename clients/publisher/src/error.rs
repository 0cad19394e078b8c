//! The crate's errors.

use std::time::Duration;

use protocol::v1::Reason;
use recording::RecordingError;
use settings::SettingsError;

/// Why a recording is not streamed, or not to its end.
#[derive(Debug, thiserror::Error)]
pub enum CartError {
    /// The configuration cannot be used.
    #[error(transparent)]
    Config(#[from] SettingsError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The cameras cannot be used.
    #[error("calibration: {0}")]
    Calibration(#[from] geometry::GeometryError),
    /// The first pair cannot be used, and those after it will be no better.
    #[error("the first {eye} image: {source}")]
    FirstPair {
        /// Which of the two.
        eye: &'static str,
        /// What is wrong with it.
        source: Box<RecordingError>,
    },
    /// There is no place to prepare a folder's images.
    #[error("temporary directory: {source}")]
    Scratch {
        /// The system's reason.
        source: std::io::Error,
    },
    /// The recording holds no pair.
    #[error("the recording holds no stereo pair")]
    Empty,
    /// The server does not want it.
    #[error("the server refuses ({}): {text}", reason.name())]
    Refused {
        /// Its reason.
        reason: Reason,
        /// What it says.
        text: String,
    },
    /// Somebody closed the session: it is not opened again.
    #[error("the session was closed: {text}")]
    SessionClosed {
        /// What the server says of it.
        text: String,
    },
    /// The server could not be reached for too long.
    #[error("no connection to {to} for {:.0} s: {problem}", after.as_secs_f64())]
    Unreachable {
        /// The server.
        to: String,
        /// How long.
        after: Duration,
        /// The last problem.
        problem: String,
    },
}

impl CartError {
    /// Whether what the user gave is at fault.
    pub fn is_bad_input(&self) -> bool {
        matches!(
            self,
            Self::Config(_)
                | Self::Recording(_)
                | Self::Calibration(_)
                | Self::FirstPair { .. }
                | Self::Empty
        )
    }
}
