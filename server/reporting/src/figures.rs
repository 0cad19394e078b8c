//! The part of `report.json` that the page shows; keys that it does not know are left alone.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

/// What a replay says of itself.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Figures {
    pub adapter: String,
    /// The recording, where the run tells.
    pub recording: Option<PathBuf>,
    pub frames: FrameCounts,
    #[serde(default)]
    pub reasons: BTreeMap<String, u64>,
    pub stages: BTreeMap<String, StageTime>,
    pub frame_ms: Quantiles,
    pub wall_s: f64,
    pub surfels: u64,
    #[serde(default)]
    pub nodes: u64,
    pub back_projection_mm: BackProjection,
    pub stream: Option<Stream>,
    pub peak_memory: PeakMemory,
    #[serde(default)]
    pub truncated: bool,
}

/// What became of the pairs.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct FrameCounts {
    pub paired: u64,
    pub dropped: u64,
    pub tracked: u64,
    pub lost: u64,
    pub fused: u64,
    pub discarded: u64,
}

/// Time of one stage.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct StageTime {
    pub runs: u64,
    pub median_ms: f64,
    pub p95_ms: f64,
    pub clock: String,
}

/// Time of a whole frame.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Quantiles {
    pub median: f64,
    pub p95: f64,
}

/// Distance of the model from the measured depth before fusion.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct BackProjection {
    pub mean: f64,
    pub rmse: f64,
    pub coverage: f64,
}

/// Cost of streaming.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Stream {
    pub bytes: u64,
    pub epochs: u64,
    pub bits_per_s_at_fps: f64,
    pub max_error_mm: f64,
}

/// High-water marks.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct PeakMemory {
    pub cpu_mib: f64,
    pub gpu_mib: f64,
}
