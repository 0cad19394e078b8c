//! `report.json`: what a replay did, how long it took, how well it fits (design section 10).

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

/// The whole report. Times are milliseconds, lengths as the key says.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The GPU (or software) adapter and its driver.
    pub adapter: String,
    /// The recording, where one was replayed.
    pub recording: Option<PathBuf>,
    /// What became of the pairs.
    pub frames: FrameCounts,
    /// Why pairs were dropped or not fused, by reason.
    pub reasons: BTreeMap<String, u64>,
    /// Time of each stage, by name.
    pub stages: BTreeMap<String, StageSummary>,
    /// Time from a pair's hand-over to its fused model, without waiting.
    pub frame_ms: Quantiles,
    /// Wall time of the whole replay, seconds.
    pub wall_s: f64,
    /// Surfels of the final model.
    pub surfels: u64,
    /// Deformation nodes of the final model; a rigid model has none.
    pub nodes: u64,
    /// Distance of the model from the observed depth before fusion, over all frames.
    pub back_projection_mm: BackProjectionSummary,
    /// Step of grey levels (0-255) where parts of the model that were last seen at different times meet, texture taken
    /// off; `None` where no such parts meet.
    pub color_seam_levels: Option<f64>,
    /// What viewers would have received; a live session counts that elsewhere.
    pub stream: Option<StreamSummary>,
    /// Largest memory held.
    pub peak_memory: PeakMemory,
    /// The recording ended in the middle of a record; all before it was replayed.
    pub truncated: bool,
}

/// Counts of pairs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FrameCounts {
    /// Images of either eye that the recording holds, in pairs or alone.
    pub received: u64,
    /// Pairs of one stamp.
    pub paired: u64,
    /// Pairs that never reached the tracker, or the model.
    pub dropped: u64,
    /// Pairs with a pose.
    pub tracked: u64,
    /// Pairs without.
    pub lost: u64,
    /// Pairs fused into the model.
    pub fused: u64,
    /// Tracked pairs not fused because they were unfit.
    pub discarded: u64,
}

/// Time of one stage over all its runs.
#[derive(Clone, Debug, Serialize)]
pub struct StageSummary {
    /// How often it ran.
    pub runs: u64,
    /// Median.
    pub median_ms: f64,
    /// 95th percentile.
    pub p95_ms: f64,
    /// `gpu` (time stamps on the device) or `cpu` (wall time).
    pub clock: &'static str,
}

/// Median and 95th percentile.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Quantiles {
    /// 50 %.
    pub median: f64,
    /// 95 %.
    pub p95: f64,
}

/// Distance between model and measurement.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BackProjectionSummary {
    /// Mean over frames of the frame's mean.
    pub mean: f64,
    /// Median over frames of the frame's median.
    pub median: f64,
    /// Root mean square over frames.
    pub rmse: f64,
    /// Median over frames of the frame's 95th percentile.
    pub p95: f64,
    /// Mean share of measured pixels that the model explains.
    pub coverage: f64,
    /// Mean over frames of the mean over every 7th block of pixels, which the solver can be told to leave out.
    pub held_out_mean: f64,
    /// The same over all other pixels.
    pub others_mean: f64,
}

/// Cost of streaming the model as it grew.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StreamSummary {
    /// Encoded bytes of all epochs.
    pub bytes: u64,
    /// Epochs.
    pub epochs: u64,
    /// Mean rate at the recording's own frame rate.
    pub bits_per_s_at_fps: f64,
    /// Largest distance of a viewer's surfel from the server's.
    pub max_error_mm: f64,
}

/// Memory high-water marks.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PeakMemory {
    /// Resident memory of the process.
    pub cpu_mib: f64,
    /// Buffers and textures held on the GPU.
    pub gpu_mib: f64,
}

/// Median and 95th percentile of `values` (nearest rank); zeros where there are none.
pub fn quantiles(values: &[f64]) -> Quantiles {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = |share: f64| {
        let index = (share * sorted.len() as f64).ceil() as usize;
        sorted.get(index.saturating_sub(1)).copied().unwrap_or(0.0)
    };
    Quantiles { median: rank(0.5), p95: rank(0.95) }
}

/// Resident high-water mark of this process in MiB; zero where the system does not tell.
pub fn peak_resident_mib() -> f64 {
    std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|status| {
            let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
            line.split_whitespace().nth(1)?.parse::<f64>().ok()
        })
        .map_or(0.0, |kib| kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_nearest_ranks() {
        let values: Vec<f64> = (1..=100).rev().map(f64::from).collect();
        let Quantiles { median, p95 } = quantiles(&values);
        assert_eq!((median, p95), (50.0, 95.0));
        assert_eq!(quantiles(&[3.0]).p95, 3.0);
        assert_eq!(quantiles(&[]).median, 0.0);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_process_uses_memory() {
        assert!(peak_resident_mib() > 1.0);
    }
}
