//! Scores of the model's surface.

mod compared;
mod reference;

use std::path::Path;

use geometry::Pose;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::Point3;
use rayon::prelude::*;
use recording::export::{PlySurfel, read_ply};
use serde::Serialize;

use crate::numpy_random::NumpyRandom;
use crate::statistics::{MM_PER_M, Statistics};
use crate::truth::Truth;
use crate::{EvaluationError, Notes};
pub use compared::{ComparedPoint, ComparedSurfaces, compared_surfaces};
use reference::Reference;

/// Points drawn from the true surface for completeness.
const SURFACE_SAMPLES: usize = 60_000;
/// Model points compared at most; of more, so many are drawn.
const MODEL_POINTS_MAX: u32 = 400_000;
/// A true point is covered by a model point within this distance (mm), and a model point is right.
const NEAR_MM: f64 = 2.0;

/// Scores of the model after the last frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SurfaceScores {
    /// Vertices of the model.
    pub model_points: Option<ModelPoints>,
    /// What the model was compared with: the true mesh, or the true depth of the last frame.
    pub surface_source: Option<&'static str>,
    /// Distance of the model's points to the true surface.
    pub surface_error_mm: Option<SurfaceError>,
    /// The same with the model hung on the true last camera in place of the estimated one: blind to drift.
    pub surface_error_camera_mm: Option<SurfaceError>,
    /// Share of the true surface, of what was seen in at least three frames, with a model point within 2 mm.
    pub completeness: Option<f64>,
    /// The same with the model hung on the true last camera.
    pub completeness_camera: Option<f64>,
}

/// How many vertices the model has.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelPoints {
    /// Vertices in the file.
    pub read: usize,
    /// Of those, left out as they are not finite.
    pub not_finite: usize,
}

/// Distances from model to truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SurfaceError {
    /// In millimetres.
    #[serde(flatten)]
    pub distance_mm: Statistics,
    /// Share of the model's points within 2 mm.
    pub within_2mm: f64,
}

pub(crate) fn score(
    results: &Path,
    truth: &Truth<'_>,
    estimates: &[Option<Pose>],
    notes: &mut Notes,
) -> Result<SurfaceScores, EvaluationError> {
    let mut scores = SurfaceScores::default();
    let Some(file) = notes.existing(results, "model.ply") else { return Ok(scores) };
    let surfels = read_ply(&file)?;
    let points = finite_points(&surfels);
    scores.model_points = Some(ModelPoints { read: surfels.len(), not_finite: surfels.len() - points.len() });
    let Some(reference) = Reference::of(truth)? else {
        notes.missing.push("truth: mesh, and depth of the last frame".into());
        return Ok(scores);
    };
    scores.surface_source = Some(reference.source);
    let points = reference.comparable(points);
    if points.is_empty() {
        return Ok(scores);
    }
    let comparison = Comparison::new(&reference, points);
    let (error, completeness) = comparison.under(&Pose::identity())?;
    (scores.surface_error_mm, scores.completeness) = (error, completeness);
    let last = truth.last_frame();
    if let Some((real, estimate)) = truth.world_from_camera(last).zip(estimates[last]) {
        let (error, completeness) = comparison.under(&(real * estimate.inverse()))?;
        (scores.surface_error_camera_mm, scores.completeness_camera) = (error, completeness);
    }
    Ok(scores)
}

fn finite_points(surfels: &[PlySurfel]) -> Vec<Point3<f64>> {
    let finite = surfels.iter().filter(|surfel| surfel.position.iter().all(|value| value.is_finite()));
    finite.map(|surfel| Point3::from(surfel.position.map(f64::from))).collect()
}

/// The points of model and truth that are compared.
struct Comparison<'a> {
    reference: &'a Reference,
    model: Vec<Point3<f64>>,
    /// Indices of the model's points whose distance is taken, where not all are.
    drawn: Option<Vec<u32>>,
    surface: Vec<Point3<f64>>,
}

impl<'a> Comparison<'a> {
    fn new(reference: &'a Reference, model: Vec<Point3<f64>>) -> Self {
        let mut random = NumpyRandom::seeded_zero();
        let surface = reference.mesh.sample(|face| reference.is_seen(face), SURFACE_SAMPLES, &mut random);
        let count = u32::try_from(model.len()).unwrap_or(u32::MAX);
        let drawn = (count > MODEL_POINTS_MAX).then(|| random.choose_distinct(count, MODEL_POINTS_MAX));
        Self { reference, model, drawn, surface }
    }

    /// Error and completeness of the model moved by `truth_from_model`.
    fn under(&self, truth_from_model: &Pose) -> Result<(Option<SurfaceError>, Option<f64>), EvaluationError> {
        let model: Vec<Point3<f64>> = self.model.iter().map(|point| truth_from_model * point).collect();
        let distance_mm = |point: &Point3<f64>| self.reference.mesh.distance_m(point) * MM_PER_M;
        let distances_mm: Vec<f64> = match &self.drawn {
            None => model.par_iter().map(distance_mm).collect(),
            Some(drawn) => drawn.par_iter().map(|&index| distance_mm(&model[index as usize])).collect(),
        };
        let within_2mm = share_near(&distances_mm);
        let error = Statistics::of(distances_mm)
            .zip(within_2mm)
            .map(|(distance_mm, within_2mm)| SurfaceError { distance_mm, within_2mm });
        Ok((error, share_near(&gaps_mm(&self.surface, &model)?)))
    }
}

/// Distance from each true point to the nearest of the model.
fn gaps_mm(surface: &[Point3<f64>], model: &[Point3<f64>]) -> Result<Vec<f64>, EvaluationError> {
    let coordinates: Vec<[f64; 3]> = model.iter().map(|&point| point.into()).collect();
    let tree: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(&coordinates)
        .map_err(|error| EvaluationError::mesh("model.ply", error))?;
    let gap_mm = |point: &Point3<f64>| {
        let nearest = tree.query(&(*point).into()).nearest_one::<SquaredEuclidean<f64>>().execute();
        nearest.distance.sqrt() * MM_PER_M
    };
    Ok(surface.par_iter().map(gap_mm).collect())
}

fn share_near(distances_mm: &[f64]) -> Option<f64> {
    let near = distances_mm.iter().filter(|&&distance_mm| distance_mm <= NEAR_MM).count();
    (!distances_mm.is_empty()).then(|| near as f64 / distances_mm.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_of_one_point_many_times_over_is_searched_too() {
        let model = vec![Point3::new(0.0, 0.0, 0.1); 1000];
        let gaps_mm = gaps_mm(&[Point3::new(0.0, 0.003, 0.104), Point3::new(0.0, 0.0, 0.1)], &model);
        let gaps_mm = gaps_mm.expect("finite points");
        assert!((gaps_mm[0] - 5.0).abs() < 1e-9 && gaps_mm[1] == 0.0, "{gaps_mm:?}");
        assert_eq!(share_near(&gaps_mm), Some(0.5));
    }
}
