//! Sessions: one patient, one rig, one tracker, one model.

mod correspondences;
pub mod engine;
pub mod gpu_engine;
pub mod hub;
pub mod intake;
pub mod lifecycle;
pub mod live;
pub mod mailbox;
pub mod quality;
pub mod registry;
mod settings;
mod tally;
pub mod worker;

pub use settings::SessionConfig;
