//! Model and truth as points, for whoever draws them.

use std::path::Path;

use geometry::Pose;
use nalgebra::Point3;
use rayon::prelude::*;

use super::reference::Reference;
use super::{SURFACE_SAMPLES, finite_points};
use crate::numpy_random::NumpyRandom;
use crate::truth::Truth;
use crate::{EvaluationError, Notes, trajectory};
use recording::export::read_ply;

/// Model and truth after the last frame, in the world of the recording.
#[derive(Clone, Debug)]
pub struct ComparedSurfaces {
    /// What the truth is made of.
    pub source: &'static str,
    /// The model, where it can be compared.
    pub model: Vec<ComparedPoint>,
    /// Points drawn from the part of the true surface that was seen.
    pub truth: Vec<Point3<f64>>,
    /// Whether the model hangs on the true last camera, which takes drift out; else on the estimated one.
    pub hung_on_true_camera: bool,
}

/// A point of the model.
#[derive(Clone, Copy, Debug)]
pub struct ComparedPoint {
    /// Metres, in the world of the recording.
    pub place: Point3<f64>,
    /// Distance to the true surface.
    pub distance_m: f64,
}

/// The surfaces that [`crate::SurfaceScores::surface_error_camera_mm`] compares; `None` without a model or a truth.
///
/// # Errors
/// As [`crate::evaluate`].
pub fn compared_surfaces(results: &Path, truth: &Truth) -> Result<Option<ComparedSurfaces>, EvaluationError> {
    let mut notes = Notes::default();
    let Some(file) = notes.existing(results, "model.ply") else { return Ok(None) };
    let Some(reference) = Reference::of(truth)? else { return Ok(None) };
    let (_, estimates) = trajectory::score(results, truth, &mut notes)?;
    let last = truth.last_frame();
    let truth_from_model =
        truth.world_from_camera(last).zip(estimates[last]).map(|(real, estimate)| real * estimate.inverse());
    let hang = truth_from_model.unwrap_or_else(Pose::identity);
    let points = reference.comparable(finite_points(&read_ply(&file)?));
    let recorded_from_world = truth.world_from_recorded.inverse();
    let compare = |point: &Point3<f64>| {
        let in_world = hang * point;
        let distance_m = reference.mesh.distance_m(&in_world);
        ComparedPoint { place: recorded_from_world * in_world, distance_m }
    };
    let mut random = NumpyRandom::seeded_zero();
    let drawn = reference.mesh.sample(|face| reference.is_seen(face), SURFACE_SAMPLES, &mut random);
    Ok(Some(ComparedSurfaces {
        source: reference.source,
        model: points.par_iter().map(compare).collect(),
        truth: drawn.iter().map(|point| recorded_from_world * point).collect(),
        hung_on_true_camera: truth_from_model.is_some(),
    }))
}
