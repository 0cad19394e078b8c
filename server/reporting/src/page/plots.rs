//! The plots of a run.

use geometry::trajectory::StampedPose;

use crate::ReportingError;
use crate::chart::{COLORS, LineChart, Series};
use crate::run::Run;
use crate::truth::Known;

const MM_PER_M: f64 = 1e3;

/// A plot with what it shows.
pub(super) struct Plot {
    pub title: &'static str,
    pub svg: String,
    pub legend: Vec<Legend>,
}

/// A line's name and its colour, as CSS says it.
pub(super) struct Legend {
    pub name: &'static str,
    pub color: String,
}

fn plot(title: &'static str, chart: &LineChart) -> Result<Plot, ReportingError> {
    let css = |color: &plotters::style::RGBColor| format!("#{:02x}{:02x}{:02x}", color.0, color.1, color.2);
    let legend = chart.series.iter().zip(COLORS.iter().cycle());
    let legend = legend.map(|(series, color)| Legend { name: series.name, color: css(color) });
    Ok(Plot { title, legend: legend.collect(), svg: chart.svg()? })
}

/// The path of the scope from above and from the front, beside the true one.
pub(super) fn trajectory(run: &Run, known: &Known) -> Result<Vec<Plot>, ReportingError> {
    let Some(estimate) = run.trajectory.as_deref().filter(|poses| !poses.is_empty()) else {
        return Ok(Vec::new());
    };
    let chart = |what, (across, x_label): (usize, _), (up, y_label): (usize, _)| {
        let mut series = vec![Series { name: "estimate", points: path_mm(estimate, across, up) }];
        if !known.true_trajectory.is_empty() {
            series.push(Series { name: "truth", points: path_mm(&known.true_trajectory, across, up) });
        }
        LineChart { what, x_label, y_label, series, one_scale: true }
    };
    let above = chart("the path from above", (0, "x (right), mm"), (2, "z (forward), mm"));
    let behind = chart("the path from behind", (0, "x (right), mm"), (1, "y (down), mm"));
    Ok(vec![plot("From above", &above)?, plot("From behind, upside down", &behind)?])
}

fn path_mm(poses: &[StampedPose], across: usize, up: usize) -> Vec<(f64, f64)> {
    let place = |pose: &StampedPose| pose.world_from_camera.translation.vector * MM_PER_M;
    poses.iter().map(place).map(|place| (place[across], place[up])).collect()
}

/// How well the model fitted each frame before that frame was fused, and what the tracker found.
pub(super) fn errors(run: &Run) -> Result<Vec<Plot>, ReportingError> {
    let mut plots = Vec::new();
    if let Some(frames) = &run.frames {
        let series = |name, value: fn(&crate::run::FrameRow) -> Option<f64>| Series {
            name,
            points: frames.iter().filter_map(|row| Some((row.frame as f64, value(row)?))).collect(),
        };
        let series = vec![series("mean", |row| row.mean_mm), series("95 %", |row| row.p95_mm)];
        let what = "back-projection error";
        let chart = LineChart { what, x_label: "frame", y_label: "mm", series, one_scale: false };
        plots.push(plot("Model against measured depth, before fusion", &chart)?);
    }
    if let Some(rows) = &run.tracking {
        let series = |name, value: fn(&crate::run::TrackingRow) -> u64| Series {
            name,
            points: rows.iter().map(|row| (row.frame as f64, value(row) as f64)).collect(),
        };
        let series =
            vec![series("map points found", |row| row.matches), series("fit the pose", |row| row.inliers)];
        let chart =
            LineChart { what: "matches", x_label: "frame", y_label: "points", series, one_scale: false };
        plots.push(plot("Tracking", &chart)?);
    }
    Ok(plots)
}

/// Bytes of each epoch.
pub(super) fn stream(run: &Run) -> Result<Option<Plot>, ReportingError> {
    let Some(rows) = &run.stream else { return Ok(None) };
    let points = rows.iter().map(|row| (row.epoch as f64, row.bytes as f64 / 1e3)).collect();
    let series = vec![Series { name: "one epoch", points }];
    let chart =
        LineChart { what: "bytes of epochs", x_label: "epoch", y_label: "kB", series, one_scale: false };
    plot("Size of each epoch", &chart).map(Some)
}
