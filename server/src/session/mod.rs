//! Sessions: one patient, one rig, one tracker, one model.

mod correspondences;
mod dense_end;
pub mod engine;
pub mod gpu_engine;
pub mod gpu_turns;
pub mod history;
pub mod hub;
pub mod intake;
pub mod journal;
pub mod lifecycle;
pub mod live;
pub mod mailbox;
mod map_changes;
pub mod quality;
pub mod recovery;
mod rectifier;
pub mod registry;
pub mod replay_source;
mod results;
mod settings;
pub mod shared_gpu;
pub mod shared_scene;
mod tally;
mod trajectory;
pub mod worker;

pub use settings::SessionConfig;
