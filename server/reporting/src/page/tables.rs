//! The tables of a run.

use evaluation::{ComparedSurfaces, Evaluation};

use super::RunView;
use crate::figures::Figures;
use crate::truth::Known;

/// A figure with its name and unit.
pub(super) struct Fact {
    pub name: &'static str,
    /// A dash where there is none.
    pub value: String,
}

/// Time of a stage.
pub(super) struct StageRow {
    pub name: String,
    pub clock: String,
    pub median_ms: String,
    pub p95_ms: String,
    pub runs: u64,
    /// Of the longest median, percent: the length of its bar.
    pub share: f64,
}

/// The runs side by side.
pub(super) struct Comparison {
    pub heads: Vec<&'static str>,
    pub rows: Vec<ComparedRun>,
}

/// One of them.
pub(super) struct ComparedRun {
    pub anchor: String,
    pub name: String,
    pub values: Vec<String>,
}

impl Comparison {
    pub fn of(runs: &[RunView]) -> Self {
        let heads = runs.first().map(|run| run.summary.iter().map(|fact| fact.name).collect());
        let row = |run: &RunView| ComparedRun {
            anchor: run.anchor.clone(),
            name: run.name.clone(),
            values: run.summary.iter().map(|fact| fact.value.clone()).collect(),
        };
        Self { heads: heads.unwrap_or_default(), rows: runs.iter().map(row).collect() }
    }
}

fn fact(name: &'static str, value: impl Into<String>) -> Fact {
    Fact { name, value: value.into() }
}

fn optional(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.2}{unit}"))
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Where the run comes from, in one line.
pub(super) fn provenance(known: &Known) -> String {
    let Some(name) = &known.name else {
        return known.absent.as_ref().map_or_else(String::new, |why| format!("recording: {why}"));
    };
    let of_group = |(group, notes): (&String, &std::collections::BTreeMap<String, String>)| {
        let notes: Vec<String> = notes.iter().map(|(key, value)| format!("{key} {value}")).collect();
        format!("{group}: {}", notes.join(", "))
    };
    let mut parts = vec![format!("recording {name}")];
    parts.extend(known.notes.iter().map(of_group));
    parts.join(" · ")
}

/// The headline.
pub(super) fn facts(figures: &Figures) -> Vec<Fact> {
    let frames = &figures.frames;
    let mut facts = vec![
        fact("pairs", frames.paired.to_string()),
        fact("tracked", format!("{} ({} lost)", frames.tracked, frames.lost)),
        fact(
            "fused",
            format!("{} ({} discarded, {} dropped)", frames.fused, frames.discarded, frames.dropped),
        ),
        fact("surfels", figures.surfels.to_string()),
        fact("deformation nodes", figures.nodes.to_string()),
        fact("back-projection, mean", format!("{:.3} mm", figures.back_projection_mm.mean)),
        fact("back-projection, root mean square", format!("{:.3} mm", figures.back_projection_mm.rmse)),
        fact("measured pixels explained", percent(figures.back_projection_mm.coverage)),
        fact(
            "frame, median (95 %)",
            format!("{:.0} ms ({:.0} ms)", figures.frame_ms.median, figures.frame_ms.p95),
        ),
        fact("whole replay", format!("{:.1} s", figures.wall_s)),
        fact(
            "memory, most",
            format!("{:.0} MiB, GPU {:.0} MiB", figures.peak_memory.cpu_mib, figures.peak_memory.gpu_mib),
        ),
        fact("adapter", figures.adapter.clone()),
    ];
    if !figures.reasons.is_empty() {
        let reasons: Vec<String> =
            figures.reasons.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
        facts.push(fact("not used, by reason", reasons.join(", ")));
    }
    if figures.truncated {
        facts.push(fact("recording", "cut short; replayed up to its last good record"));
    }
    facts
}

/// Every stage, the longest first.
pub(super) fn stages(figures: &Figures) -> Vec<StageRow> {
    let longest_ms = figures.stages.values().map(|stage| stage.median_ms).fold(0.0, f64::max);
    let mut stages: Vec<_> = figures.stages.iter().collect();
    stages.sort_by(|a, b| b.1.median_ms.total_cmp(&a.1.median_ms));
    let row = |(name, stage): (&String, &crate::figures::StageTime)| StageRow {
        name: name.clone(),
        clock: stage.clock.clone(),
        median_ms: format!("{:.2}", stage.median_ms),
        p95_ms: format!("{:.2}", stage.p95_ms),
        runs: stage.runs,
        share: if longest_ms > 0.0 { (100.0 * stage.median_ms / longest_ms).clamp(0.0, 100.0) } else { 0.0 },
    };
    stages.into_iter().map(row).collect()
}

/// What a viewer would have received.
pub(super) fn stream(figures: &Figures) -> Vec<Fact> {
    let Some(stream) = &figures.stream else { return Vec::new() };
    let per_epoch_kb = stream.bytes as f64 / stream.epochs.max(1) as f64 / 1e3;
    vec![
        fact("at the recording's rate, mean", format!("{:.2} Mbit/s", stream.bits_per_s_at_fps / 1e6)),
        fact("in all", format!("{:.2} MB in {} epochs", stream.bytes as f64 / 1e6, stream.epochs)),
        fact("an epoch, mean", format!("{per_epoch_kb:.1} kB")),
        fact("farthest that a viewer's surfel was off", format!("{:.3} mm", stream.max_error_mm)),
    ]
}

/// Scores against the truth; empty without one.
pub(super) fn scores(known: &Known) -> Vec<Fact> {
    let Some(scores) = &known.scores else { return Vec::new() };
    let Evaluation { trajectory, depth, surface, points, .. } = scores;
    let surface_mm =
        |error: &Option<evaluation::SurfaceError>| error.as_ref().map(|error| error.distance_mm.mean);
    let nonrigid = points.point_error_nonrigid_mm.as_ref();
    let figures = [
        ("trajectory, root mean square (aligned)", trajectory.ate_rmse_mm, " mm"),
        ("motion between frames, root mean square", trajectory.rpe_trans_mm, " mm"),
        ("turn between frames, root mean square", trajectory.rpe_rot_deg, "°"),
        ("depth, mean", depth.depth_mae_mm, " mm"),
        ("depth, share of true pixels", depth.depth_coverage, ""),
        ("surface in camera, mean", surface_mm(&surface.surface_error_camera_mm), " mm"),
        ("surface in world, mean", surface_mm(&surface.surface_error_mm), " mm"),
        ("completeness in camera", surface.completeness_camera, ""),
        ("completeness in world", surface.completeness, ""),
        ("points in camera, mean", points.point_error_camera_mm.map(|error| error.mean), " mm"),
        ("points in world, mean", points.point_error_mm.as_ref().map(|error| error.distance_mm.mean), " mm"),
        ("points, beyond rigid motion, mean", nonrigid.map(|error| error.distance_mm.mean), " mm"),
        ("nonrigid motion explained", nonrigid.and_then(|error| error.explained), ""),
    ];
    let known = figures.into_iter().filter(|(_, value, _)| value.is_some());
    known.map(|(name, value, unit)| fact(name, optional(value, unit))).collect()
}

/// What the views of the model against the truth show.
pub(super) fn planes_of(surfaces: &ComparedSurfaces) -> String {
    let hung = if surfaces.hung_on_true_camera { "true" } else { "estimated" };
    format!("{}; the model hangs on the {hung} last camera", surfaces.source)
}

/// What is compared between runs.
pub(super) fn summary(figures: &Figures, known: &Known) -> Vec<Fact> {
    let scores = known.scores.as_ref();
    let of = |value: fn(&Evaluation) -> Option<f64>| optional(scores.and_then(value), "");
    let megabits = figures.stream.as_ref().map(|stream| stream.bits_per_s_at_fps / 1e6);
    vec![
        fact("pairs", figures.frames.paired.to_string()),
        fact("tracked", percent(figures.frames.tracked as f64 / figures.frames.paired.max(1) as f64)),
        fact("frame, ms", format!("{:.0}", figures.frame_ms.median)),
        fact("back-projection, mm", format!("{:.2}", figures.back_projection_mm.mean)),
        fact("trajectory, mm", of(|scores| scores.trajectory.ate_rmse_mm)),
        fact("depth, mm", of(|scores| scores.depth.depth_mae_mm)),
        fact("points in camera, mm", of(|scores| Some(scores.points.point_error_camera_mm?.mean))),
        fact(
            "points in world, mm",
            of(|scores| Some(scores.points.point_error_mm.as_ref()?.distance_mm.mean)),
        ),
        fact(
            "surface in camera, mm",
            of(|scores| Some(scores.surface.surface_error_camera_mm.as_ref()?.distance_mm.mean)),
        ),
        fact("stream, Mbit/s", optional(megabits, "")),
        fact("surfels", figures.surfels.to_string()),
    ]
}
