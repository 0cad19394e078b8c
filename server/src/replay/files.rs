//! The files of a replay's results.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use gpu::Gpu;
use recording::PairingStatistics;
use recording::export;

use super::collector::{Collected, Running};
use super::frames::{FrameRow, write_rows};
use super::report::{
    BackProjectionSummary, FrameCounts, PeakMemory, Quantiles, Report, StageSummary, peak_resident_mib,
    quantiles,
};
use super::{ReplayError, ReplayOptions, seams};
use crate::convert;
use crate::session::engine::EngineResults;

/// What the report says about the run as a whole.
pub struct Run<'a> {
    pub gpu: &'a Gpu,
    /// The recording, where one was replayed.
    pub recording: Option<&'a Path>,
    pub statistics: &'a PairingStatistics,
    pub truncated: bool,
    pub wall: Duration,
}

/// Makes the directories for the results, before hours are spent on them.
pub fn make_directories(options: &ReplayOptions) -> Result<(), ReplayError> {
    let Running { depth_directory, views, feature_directory } = options.running();
    let views = views.map(|(directory, _)| directory);
    for directory in
        [Some(options.out.clone()), depth_directory, views, feature_directory].into_iter().flatten()
    {
        std::fs::create_dir_all(&directory).map_err(ReplayError::io(&directory))?;
    }
    Ok(())
}

/// Writes all results and gives the report back.
pub fn write(out: &Path, collected: &Collected, run: &Run) -> Result<Report, ReplayError> {
    export::write_tum(&out.join("trajectory.tum"), &collected.trajectory).map_err(ReplayError::Results)?;
    if !collected.points.estimates().is_empty() {
        export::write_points(&out.join("points.csv"), collected.points.estimates())
            .map_err(ReplayError::Results)?;
    }
    write_rows(&out.join("frames.csv"), &collected.frames.values())?;
    write_rows(&out.join("tracking.csv"), &collected.tracking.values())?;
    if let Some(stream) = &collected.stream {
        write_rows(&out.join("stream.csv"), stream.rows())?;
    }
    let results = results(collected, run);
    write_results(out, &results)?;
    Ok(results.report)
}

/// What was collected, in the form of the result files.
pub fn results(collected: &Collected, run: &Run) -> EngineResults {
    EngineResults {
        model: collected.model.iter().map(convert::ply_surfel).collect(),
        picture: collected.picture.clone(),
        report: report(collected, run),
    }
}

/// Writes model, picture and report.
pub fn write_results(out: &Path, results: &EngineResults) -> Result<(), ReplayError> {
    export::write_ply(&out.join("model.ply"), &results.model).map_err(ReplayError::Results)?;
    if let Some(picture) = &results.picture {
        let file = out.join("model.png");
        write_bytes(&file, &recording::encode_png_rgb(picture).map_err(ReplayError::Results)?.bytes)?;
    }
    let text =
        serde_json::to_string_pretty(&results.report).expect("a report has string keys and finite numbers");
    write_bytes(&out.join("report.json"), (text + "\n").as_bytes())
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), ReplayError> {
    std::fs::write(path, bytes).map_err(ReplayError::io(path))
}

fn report(collected: &Collected, run: &Run) -> Report {
    let duration_s = collected.stamps_ns.map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9);
    Report {
        adapter: format!("{}, {}", run.gpu.description().name, run.gpu.description().driver),
        recording: run.recording.map(|path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf())),
        frames: frame_counts(collected, run.statistics),
        reasons: reasons(collected, run.statistics),
        stages: collected.stages.iter().map(|(&name, stage)| (name.into(), stage_summary(stage))).collect(),
        frame_ms: quantiles(&collected.frame_ms.values()),
        wall_s: run.wall.as_secs_f64(),
        surfels: collected.model.len() as u64,
        nodes: u64::from(collected.nodes),
        back_projection_mm: back_projection(&collected.frames.values()),
        color_seam_levels: seams::color_step_levels(&collected.model),
        stream: collected.stream.as_ref().map(|stream| stream.summary(duration_s)),
        peak_memory: PeakMemory {
            cpu_mib: peak_resident_mib(),
            gpu_mib: run.gpu.memory_use().peak_bytes as f64 / f64::from(1 << 20),
        },
        truncated: run.truncated,
    }
}

fn frame_counts(collected: &Collected, statistics: &PairingStatistics) -> FrameCounts {
    let unpaired = statistics.unpaired_left + statistics.unpaired_right;
    FrameCounts {
        received: statistics.pairs + unpaired,
        paired: statistics.pairs,
        ..collected.counts.clone()
    }
}

fn reasons(collected: &Collected, statistics: &PairingStatistics) -> BTreeMap<String, u64> {
    let of_pairing = [
        ("unpaired_left", statistics.unpaired_left),
        ("unpaired_right", statistics.unpaired_right),
        ("duplicate_stamp", statistics.duplicates),
        ("stale_stamp", statistics.late),
        ("malformed_message", statistics.malformed),
    ];
    let of_pairing = of_pairing.into_iter().filter(|(_, count)| *count > 0);
    let mut all = collected.reasons.clone();
    all.extend(of_pairing.map(|(reason, count)| (reason.to_string(), count)));
    all
}

fn stage_summary(stage: &super::collector::Stage) -> StageSummary {
    let Quantiles { median, p95 } = quantiles(&stage.ms.values());
    StageSummary { runs: stage.ms.total(), median_ms: median, p95_ms: p95, clock: stage.clock }
}

fn back_projection(frames: &[FrameRow]) -> BackProjectionSummary {
    let values = |of: fn(&FrameRow) -> Option<f64>| frames.iter().filter_map(of).collect::<Vec<f64>>();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    BackProjectionSummary {
        mean: mean(&values(|frame| frame.mean_mm)),
        median: quantiles(&values(|frame| frame.median_mm)).median,
        rmse: mean(&values(|frame| Some(frame.rmse_mm?.powi(2)))).sqrt(),
        p95: quantiles(&values(|frame| frame.p95_mm)).median,
        coverage: mean(&values(|frame| frame.coverage)),
        held_out_mean: mean(&values(|frame| frame.held_out_mean_mm)),
        others_mean: mean(&values(|frame| frame.others_mean_mm)),
    }
}

impl From<ReplayError> for crate::cli::Failure {
    fn from(error: ReplayError) -> Self {
        if error.is_bad_input() { Self::bad_input(error) } else { Self::failed(error) }
    }
}
