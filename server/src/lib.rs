//! Networked reconstruction server for stereo endoscopy.
//!
//! The only crate that knows tokio, axum and zenoh. `tracking` and `dense` meet in [`session::worker`], the wire
//! format and the domain meet in [`convert`], and nowhere else.

pub mod cli;
pub mod config;
pub mod replay;
pub mod session;
pub mod telemetry;
