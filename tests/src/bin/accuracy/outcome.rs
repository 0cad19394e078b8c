//! Everything that figures are taken from.

use std::path::Path;

use evaluation::Evaluation;
use mis_slam::replay::{FrameRow, Report};

use crate::error::AccuracyError;

/// What one replay came to.
pub struct Outcome {
    /// Scores against the truth.
    pub scores: Evaluation,
    /// The replay's own report.
    pub report: Report,
    /// Its frames.
    pub frames: Vec<FrameRow>,
    /// Root of the mean square difference (mm) of the model's depth from the truth's, see [`crate::view_depth`].
    pub view_depth_rmse_mm: Option<f64>,
    /// The same of the measured depth.
    pub measured_depth_rmse_mm: Option<f64>,
}

impl Outcome {
    /// Scores the results in `directory`.
    pub fn of(directory: &Path, scores: Evaluation, report: Report) -> Result<Self, AccuracyError> {
        let frames = FrameRow::read(&directory.join("frames.csv"))?;
        Ok(Self { scores, report, frames, view_depth_rmse_mm: None, measured_depth_rmse_mm: None })
    }

    /// Mean error of the material points in the camera, mm.
    pub fn points_in_camera_mm(&self) -> Option<f64> {
        Some(self.scores.points.point_error_camera_mm.as_ref()?.mean)
    }

    /// Mean error of the material points in the world, mm: the paper's figure.
    pub fn points_in_world_mm(&self) -> Option<f64> {
        Some(self.scores.points.point_error_mm.as_ref()?.distance_mm.mean)
    }

    /// Share of the motion that is not rigid which the model follows.
    pub fn explained(&self) -> Option<f64> {
        self.scores.points.point_error_nonrigid_mm.as_ref()?.explained
    }

    /// Mean world error of the points that moved by more than 1 mm, mm.
    pub fn moved_points_mm(&self) -> Option<f64> {
        Some(self.scores.points.point_error_moved_mm.as_ref()?.distance_mm.mean)
    }

    /// Mean distance of the model from the true surface, each in its camera, mm.
    pub fn surface_in_camera_mm(&self) -> Option<f64> {
        Some(self.scores.surface.surface_error_camera_mm.as_ref()?.distance_mm.mean)
    }

    /// Share of the surface seen by the camera that the model covers.
    pub fn completeness_in_camera(&self) -> Option<f64> {
        self.scores.surface.completeness_camera
    }

    /// Mean back-projection error over all frames, mm.
    pub fn back_projection_mm(&self) -> Option<f64> {
        mean(self.frames.iter().filter_map(|frame| frame.mean_mm))
    }

    /// Mean back-projection error of the pixels that were not held out, mm.
    pub fn others_mm(&self) -> Option<f64> {
        mean(self.frames.iter().filter_map(|frame| frame.others_mean_mm))
    }

    /// The error of the held-out pixels over that of the others.
    pub fn held_out_ratio(&self) -> Option<f64> {
        let held_out = mean(self.frames.iter().filter_map(|frame| frame.held_out_mean_mm))?;
        Some(held_out / self.others_mm()?)
    }

    /// Root of the mean square error of the held-out pixels over some frames, mm.
    pub fn held_out_rmse_mm(&self, first: u64, last: u64) -> Option<f64> {
        let frames = self.frames.iter().filter(|frame| (first..=last).contains(&frame.frame));
        Some(mean(frames.filter_map(|frame| Some(frame.held_out_rmse_mm?.powi(2))))?.sqrt())
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
