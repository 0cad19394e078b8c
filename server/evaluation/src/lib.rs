//! Scores of a replay against the truth in its recording, as `mis-slam eval` prints them.
//!
//! Three frames matter. *World* is the first left camera, for the truth as for the replay. The keys `*_camera_mm`
//! compare in the camera, so that they are blind to drift of the trajectory. `point_error_nonrigid_mm` takes the best
//! rigid motion out of each frame: where all tissue moves at once, no stereo camera can tell that from its own motion,
//! and a perfect system still errs in the world.

mod depth;
mod error;
mod mesh;
mod numpy_random;
mod points;
mod statistics;
mod surface;
mod trajectory;
mod truth;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use depth::{DepthDetail, DepthFrames, DepthScores};
pub use error::EvaluationError;
pub use points::{MovedPoints, NonrigidPoints, PointScores, WorldPoints};
pub use statistics::Statistics;
pub use surface::{
    ComparedPoint, ComparedSurfaces, ModelPoints, SurfaceError, SurfaceScores, compared_surfaces,
};
pub use trajectory::{PoseCounts, TrajectoryScores};
pub use truth::Truth;

/// All scores of one replay; what could not be computed is `None`, and `missing` says why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// Stereo pairs in the recording.
    pub frames: usize,
    /// Result files and truth channels that are not there.
    pub missing: Vec<String>,
    /// What looks wrong with the results.
    pub warnings: Vec<String>,
    /// Camera motion.
    #[serde(flatten)]
    pub trajectory: TrajectoryScores,
    /// Depth maps.
    #[serde(flatten)]
    pub depth: DepthScores,
    /// The model's surface.
    #[serde(flatten)]
    pub surface: SurfaceScores,
    /// Material points.
    #[serde(flatten)]
    pub points: PointScores,
}

/// What is noticed on the way.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    pub missing: Vec<String>,
    pub warnings: Vec<String>,
}

impl Notes {
    /// The path of a result file, noted as missing where it is not there.
    pub(crate) fn existing(&mut self, results: &Path, name: &str) -> Option<PathBuf> {
        let path = results.join(name);
        if path.is_file() {
            return Some(path);
        }
        self.missing.push(name.to_owned());
        None
    }
}

/// Scores the folder that a replay wrote (`trajectory.tum`, `depth/*.pfm`, `model.ply`, `points.csv`) against the
/// truth in its recording.
///
/// # Errors
/// [`EvaluationError`] where the folder or the truth cannot be read, or a result file is damaged; an absent result file
/// is listed in [`Evaluation::missing`].
pub fn evaluate(results: &Path, truth: &Truth) -> Result<Evaluation, EvaluationError> {
    if !results.is_dir() {
        return Err(EvaluationError::NoResults(results.to_path_buf()));
    }
    let mut notes = Notes::default();
    let (trajectory, estimates) = trajectory::score(results, truth, &mut notes)?;
    let depth = depth::score(results, truth, &mut notes)?;
    let surface = surface::score(results, truth, &estimates, &mut notes)?;
    let points = points::score(results, truth, &estimates, &mut notes)?;
    let Notes { missing, warnings } = notes;
    Ok(Evaluation {
        frames: truth.frame_stamps_ns.len(),
        missing,
        warnings,
        trajectory,
        depth,
        surface,
        points,
    })
}
