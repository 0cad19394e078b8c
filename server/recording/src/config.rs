//! Section `[recording]` of the configuration.

use serde::Deserialize;

/// How recordings are written and read; the values live in `config/server.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingConfig {
    /// Compression of chunks.
    pub compression: Compression,
    /// Effort of the compression, 1 (fast) to 19 for zstd, 1 to 12 for lz4.
    pub compression_level: u32,
    /// Size (MiB) at which a chunk is closed.
    pub chunk_mib: u32,
    /// Span of stamps (ms) after which what was recorded is handed to the operating system.
    pub flush_interval_ms: u64,
    /// Frames that are held to put pairs together and in order.
    pub pairing_window_frames: usize,
    /// Quality of the JPEG images that pictures of a video become, 1 to 100.
    pub video_jpeg_quality: u8,
    /// Largest record or chunk (MiB) that is read.
    pub record_limit_mib: usize,
    /// Names of the topics.
    pub topics: Topics,
}

/// How the chunks of a recording are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Not at all.
    None,
    /// lz4.
    Lz4,
    /// Zstandard.
    Zstd,
}

/// Names of the topics, for reading and writing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Topics {
    /// Images of the left camera.
    pub left_image: String,
    /// Images of the right camera.
    pub right_image: String,
    /// Calibration of the left camera.
    pub left_calibration: String,
    /// Calibration of the right camera.
    pub right_calibration: String,
    /// Instrument masks in the left view.
    pub left_mask: String,
    /// True camera poses.
    pub truth_pose: String,
    /// True depth in the left rectified view.
    pub truth_depth: String,
    /// True places of material points.
    pub truth_points: String,
    /// Estimated camera poses.
    pub pose: String,
    /// The estimated surfel model.
    pub model: String,
}
