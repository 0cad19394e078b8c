//! The crate's errors.

/// What the tracker refuses. A frame that cannot be tracked is no error but an [`Outcome`](crate::Outcome).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackingError {
    /// A configuration value out of its range.
    #[error("tracking.{key} = {value}, it must be {requirement}")]
    Config {
        /// Key below `[tracking]`.
        key: &'static str,
        /// What it was.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// An image that is not of the rig's size.
    #[error("the {what} image is {}x{}, the rig's are {}x{}", got.0, got.1, expected.0, expected.1)]
    ImageSize {
        /// `left`, `right` or `mask`.
        what: &'static str,
        /// Columns and rows of the rig.
        expected: (u32, u32),
        /// Columns and rows of the image.
        got: (u32, u32),
    },
    /// A rig whose images are too small for the coarsest pyramid level.
    #[error(
        "images of {width}x{height} are too small for {levels} pyramid levels (tracking.features.levels)"
    )]
    RigSize {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Pyramid levels.
        levels: u32,
    },
    /// A rig value that no stereo camera has.
    #[error("the rig's {field} is {value}, it must be positive and finite")]
    Rig {
        /// Field of the rig.
        field: &'static str,
        /// What it was.
        value: f64,
    },
    /// The mapping thread could not be started, or has died.
    #[error("the mapping thread: {0}")]
    MappingThread(String),
    /// A frame that is not newer than the one before.
    #[error("frame stamp {stamp_ns} ns is not after the last one, {last_ns} ns")]
    Stamp {
        /// The frame's.
        stamp_ns: u64,
        /// The last frame's.
        last_ns: u64,
    },
}
