//! A viewer's copy of a session's model, as `protocol/SPEC.md` describes it: decode, find nodes, warp, apply, check.
//!
//! [`Replica`] takes the messages of the model lane in and holds the surfels to draw. It does no I/O and needs no GPU;
//! the page's `clients/web/src/model` is its twin, and both are checked against `protocol/golden`.

mod binding;
mod error;
mod replica;
mod seeding;
mod surfel;
mod warp;

pub use binding::{Binding, NodeFinder, NodeIndex};
pub use error::ReplicaError;
pub use replica::{Progress, Replica};
pub use surfel::Surfel;
pub use warp::Warp;
