//! What the benchmark is told.

use std::path::PathBuf;

use clap::Parser;

/// Measures the surfel stream.
#[derive(Clone, Debug, Parser)]
pub struct Arguments {
    /// Surfels that all deform.
    #[arg(long, default_value_t = 100_000)]
    pub surfels: u32,
    /// Frames of the run with many viewers.
    #[arg(long, default_value_t = 240)]
    pub frames: usize,
    /// Frames a second.
    #[arg(long, default_value_t = 30.0)]
    pub rate_hz: f64,
    /// Viewers at once.
    #[arg(long, default_value_t = 16)]
    pub viewers: usize,
    /// Surfels of the model that is joined late.
    #[arg(long, default_value_t = 300_000)]
    pub late_surfels: u32,
    /// Frames of it.
    #[arg(long, default_value_t = 60)]
    pub late_frames: usize,
    /// Where the figures go, as JSON.
    #[arg(long, default_value = "target/stream.json")]
    pub out: PathBuf,
}
