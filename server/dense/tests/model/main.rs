//! The surfel model on synthetic observations.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

mod bending;
mod changes;
mod deformation;
mod fusion;
mod hostile;
mod light;
mod rendering;
mod scene;
