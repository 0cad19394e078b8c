//! The crate's errors.

/// Why a scene could not be built or written.
#[derive(Debug, thiserror::Error)]
pub enum SimulatorError {
    /// No scene of that name.
    #[error("unknown scene {name:?}; known: heart, liver, kidney, phantom, abdomen")]
    UnknownScene {
        /// As given.
        name: String,
    },
    /// A configured value is outside what can be simulated.
    #[error("simulate.{key} = {value} is outside {min} to {max}")]
    OutOfRange {
        /// Key in the section `[simulate]`.
        key: &'static str,
        /// As given.
        value: f64,
        /// Least allowed value.
        min: f64,
        /// Greatest allowed value.
        max: f64,
    },
    /// A frame past the end of the run.
    #[error("frame {frame} of a run of {frames}")]
    NoSuchFrame {
        /// As asked.
        frame: u32,
        /// Frames of the run.
        frames: u32,
    },
    /// No tissue lies in view at any sampled frame.
    #[error("no tissue is in view, so there are no material points to follow")]
    NothingInView,
    /// The truth arrays could not be written.
    #[error("truth mesh not written: {0}")]
    TruthMesh(#[from] std::io::Error),
}
