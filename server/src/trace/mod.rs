//! What each thread and the GPU did when, as a file for Perfetto or Chrome's `about:tracing`.
//!
//! Stages of the computation are `tracing` spans of level TRACE in our crates, which cost nothing while nobody listens. This
//! layer listens: each span becomes a record on its thread's track, each pass of the GPU one on the GPU's, with the number
//! of its frame. Passes are placed on the CPU's clock by the `gpu` crate, which says how.

mod file;
mod layer;

pub use file::{TraceError, TraceFile};
pub use layer::{TraceLayer, stages};
