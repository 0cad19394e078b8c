//! The crate's errors.

use std::path::PathBuf;
use std::time::Duration;

use gpu::GpuError;

/// Why a viewer stops.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The GPU refused or is lost.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// There is no display, or it refused.
    #[error("no window: {0}")]
    Window(String),
    /// A thread could not be started.
    #[error("cannot start the thread that follows the session: {0}")]
    Thread(#[source] std::io::Error),
    /// The picture cannot be written.
    #[error("{}: {source}", .path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
    /// No model came in time.
    #[error("no model after {:.0} s: {}", .after.as_secs_f64(), .why)]
    NoModel {
        /// How long.
        after: Duration,
        /// What is known of the reason.
        why: String,
    },
}
