//! Networked reconstruction server for stereo endoscopy.
//!
//! The only crate that knows tokio, axum and zenoh. `tracking` and `dense` meet in [`session::worker`], the wire
//! format and the domain meet in [`convert`], and nowhere else.

pub mod bench;
pub mod cli;
pub mod config;
pub mod convert;
mod feature_picture;
pub mod http;
pub mod ingest;
pub mod local_view;
pub mod picture;
pub mod publish;
mod random;
pub mod replay;
pub mod service;
pub mod session;
pub mod simulated;
pub mod storage;
pub mod telemetry;
pub mod trace;
