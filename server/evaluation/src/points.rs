//! Scores of the material points that the model carries along.

use std::collections::BTreeMap;
use std::path::Path;

use geometry::Pose;
use geometry::trajectory::{Scale, umeyama};
use nalgebra::Point3;
use recording::export::{TrackedPoint, read_points};
use serde::Serialize;

use crate::statistics::{MM_PER_M, Statistics, mean_square};
use crate::truth::Truth;
use crate::{EvaluationError, Notes};

/// A point farther (m) from where it was in its first row has moved.
const MOVED_M: f64 = 1e-3;
/// Fewest points of a frame from which its rigid motion is taken.
const RIGID_POINTS_MIN: usize = 20;
/// Mean square (mm^2) of true motion below which there is nothing to explain.
const STILL_MM2: f64 = 1e-12;

/// Scores of all rows whose point is known in the truth at that frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PointScores {
    /// Distance to the true place, in the world.
    pub point_error_mm: Option<WorldPoints>,
    /// Distance between estimate and truth, each in its own camera: blind to drift.
    pub point_error_camera_mm: Option<Statistics>,
    /// What the same rows would score had nothing moved since each point's first row.
    pub point_error_static_mm: Option<Statistics>,
    /// Distance after the best rigid motion of each frame is taken out.
    pub point_error_nonrigid_mm: Option<NonrigidPoints>,
    /// World error of the rows whose true point is over 1 mm from where it was in its first row.
    pub point_error_moved_mm: Option<MovedPoints>,
}

/// Errors in the world.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorldPoints {
    /// In millimetres.
    #[serde(flatten)]
    pub distance_mm: Statistics,
    /// Different points.
    pub points: usize,
    /// Points in the truth.
    pub points_in_truth: usize,
    /// Rows left out: no such point or frame in the truth, or not finite.
    pub unknown_rows: usize,
}

/// Errors beyond rigid motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NonrigidPoints {
    /// In millimetres.
    #[serde(flatten)]
    pub distance_mm: Statistics,
    /// The mean had nothing moved since each point's first row.
    pub static_mean: f64,
    /// Share of the true nonrigid motion (mean square) that the model follows; `None` where there is none.
    pub explained: Option<f64>,
}

/// Errors of points that moved.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MovedPoints {
    /// In millimetres.
    #[serde(flatten)]
    pub distance_mm: Statistics,
    /// The mean had nothing moved since each point's first row.
    pub static_mean: f64,
}

/// A row of `points.csv` with what is true of it; places in world.
struct Row {
    frame: usize,
    id: u32,
    estimate: Point3<f64>,
    truth: Point3<f64>,
    /// Where the point truly was in its first row, if that is known.
    anchor: Option<Point3<f64>>,
}

impl Row {
    fn error_mm(&self) -> f64 {
        (self.estimate - self.truth).norm() * MM_PER_M
    }

    /// How far the point truly is from its anchor.
    fn moved_mm(&self) -> Option<f64> {
        Some((self.anchor? - self.truth).norm() * MM_PER_M)
    }
}

pub(crate) fn score(
    results: &Path,
    truth: &Truth<'_>,
    estimates: &[Option<Pose>],
    notes: &mut Notes,
) -> Result<PointScores, EvaluationError> {
    let Some(file) = notes.existing(results, "points.csv") else { return Ok(PointScores::default()) };
    if !truth.has_points() {
        notes.missing.push("truth: points".into());
        return Ok(PointScores::default());
    }
    let tracked = read_points(&file)?;
    if tracked.is_empty() {
        notes.missing.push("points.csv (no rows)".into());
        return Ok(PointScores::default());
    }
    let read = tracked.len();
    let rows = known_rows(tracked, truth);
    let Some(distance_mm) = Statistics::of(rows.iter().map(Row::error_mm).collect()) else {
        return Ok(PointScores::default());
    };
    // Rows are sorted by id.
    let points = rows.chunk_by(|a, b| a.id == b.id).count();
    let world = WorldPoints {
        distance_mm,
        points,
        points_in_truth: truth.points_at_first,
        unknown_rows: read - rows.len(),
    };
    Ok(PointScores {
        point_error_mm: Some(world),
        point_error_camera_mm: Statistics::of(camera_errors_mm(&rows, truth, estimates)),
        point_error_static_mm: Statistics::of(rows.iter().filter_map(Row::moved_mm).collect()),
        point_error_nonrigid_mm: nonrigid(&rows),
        point_error_moved_mm: moved(&rows),
    })
}

/// The rows that the truth knows, sorted by id and frame, each with its anchor.
fn known_rows(mut tracked: Vec<TrackedPoint>, truth: &Truth<'_>) -> Vec<Row> {
    tracked.sort_by_key(|point| (point.id, point.frame));
    let mut rows = Vec::with_capacity(tracked.len());
    for track in tracked.chunk_by(|a, b| a.id == b.id) {
        let place = |point: &TrackedPoint| truth.points(point.frame as usize)?.get(&point.id).copied();
        let anchor = place(&track[0]);
        rows.extend(track.iter().filter_map(|point| {
            let truth = place(point).filter(is_finite)?;
            let estimate = Some(point.point_in_world).filter(is_finite)?;
            Some(Row { frame: point.frame as usize, id: point.id, estimate, truth, anchor })
        }));
    }
    rows
}

fn is_finite(point: &Point3<f64>) -> bool {
    point.iter().all(|value| value.is_finite())
}

fn camera_errors_mm(rows: &[Row], truth: &Truth<'_>, estimates: &[Option<Pose>]) -> Vec<f64> {
    let error_mm = |row: &Row| {
        let estimate = estimates[row.frame]?.inverse_transform_point(&row.estimate);
        let truth = truth.world_from_camera(row.frame)?.inverse_transform_point(&row.truth);
        Some((estimate - truth).norm() * MM_PER_M)
    };
    rows.iter().filter_map(error_mm).collect()
}

fn moved(rows: &[Row]) -> Option<MovedPoints> {
    let (errors_mm, moved_mm): (Vec<f64>, Vec<f64>) = rows
        .iter()
        .filter_map(|row| Some((row.error_mm(), row.moved_mm()?)))
        .filter(|&(_, moved_mm)| moved_mm > MOVED_M * MM_PER_M)
        .unzip();
    let static_mean = Statistics::of(moved_mm)?.mean;
    Statistics::of(errors_mm).map(|distance_mm| MovedPoints { distance_mm, static_mean })
}

fn nonrigid(rows: &[Row]) -> Option<NonrigidPoints> {
    let mut frames: BTreeMap<usize, Vec<&Row>> = BTreeMap::new();
    for row in rows {
        frames.entry(row.frame).or_default().push(row);
    }
    let (mut errors_mm, mut static_mm) = (Vec::new(), Vec::new());
    for rows in frames.values().filter(|rows| rows.len() >= RIGID_POINTS_MIN) {
        let truths: Vec<_> = rows.iter().map(|row| row.truth).collect();
        let estimates: Vec<_> = rows.iter().map(|row| row.estimate).collect();
        errors_mm.extend(errors_beyond_rigid_mm(&estimates, &truths));
        let (anchors, truths): (Vec<_>, Vec<_>) =
            rows.iter().filter_map(|row| Some((row.anchor?, row.truth))).unzip();
        static_mm.extend(errors_beyond_rigid_mm(&anchors, &truths));
    }
    let explained = explained(&errors_mm, &static_mm);
    let static_mean = Statistics::of(static_mm)?.mean;
    Statistics::of(errors_mm).map(|distance_mm| NonrigidPoints { distance_mm, static_mean, explained })
}

fn explained(errors_mm: &[f64], static_mm: &[f64]) -> Option<f64> {
    let motion_mm2 = mean_square(static_mm);
    (motion_mm2 > STILL_MM2).then(|| 1.0 - mean_square(errors_mm) / motion_mm2)
}

fn errors_beyond_rigid_mm(points: &[Point3<f64>], truths: &[Point3<f64>]) -> Vec<f64> {
    let Some(rigid) = umeyama(points, truths, Scale::One) else { return Vec::new() };
    points
        .iter()
        .zip(truths)
        .map(|(point, truth)| (rigid.transform(point) - truth).norm() * MM_PER_M)
        .collect()
}
