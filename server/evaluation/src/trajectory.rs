//! Scores of the camera's motion.

use std::path::Path;

use geometry::Pose;
use geometry::trajectory::{Clock, associate, ate, path_length_m, pose_error, rpe};
use recording::export::read_tum;
use serde::Serialize;

use crate::statistics::MM_PER_M;
use crate::truth::Truth;
use crate::{EvaluationError, Notes};

/// Scores of the trajectory; millimetres and degrees.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TrajectoryScores {
    /// What was read.
    pub poses: Option<PoseCounts>,
    /// Share of the true poses that have an estimate.
    pub tracked: Option<f64>,
    /// Root mean square of position errors after the best rigid alignment.
    pub ate_rmse_mm: Option<f64>,
    /// The largest of those errors.
    pub ate_max_mm: Option<f64>,
    /// Root mean square with both worlds taken as equal.
    pub ate_unaligned_rmse_mm: Option<f64>,
    /// The scale that a similarity alignment would choose.
    pub scale: Option<f64>,
    /// Length of the true path over the frames with an estimate.
    pub path_mm: Option<f64>,
    /// Root mean square of the translation error of the motion between neighbouring frames.
    pub rpe_trans_mm: Option<f64>,
    /// The same of the rotation.
    pub rpe_rot_deg: Option<f64>,
    /// Translation error of the motion from the first to the last estimate.
    pub end_error_mm: Option<f64>,
    /// Rotation error of that motion.
    pub end_error_deg: Option<f64>,
}

/// How many poses the trajectory has.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PoseCounts {
    /// Lines of the file.
    pub read: usize,
    /// Frames that got a pose.
    pub matched: usize,
    /// `absolute` or `relative` to the first frame, or `none` where no stamp fits a frame.
    pub stamps: &'static str,
}

/// The scores, and the estimated pose of each frame.
pub(crate) fn score(
    results: &Path,
    truth: &Truth<'_>,
    notes: &mut Notes,
) -> Result<(TrajectoryScores, Vec<Option<Pose>>), EvaluationError> {
    let mut scores = TrajectoryScores::default();
    let mut estimates = vec![None; truth.frame_stamps_ns.len()];
    let Some(file) = notes.existing(results, "trajectory.tum") else {
        return Ok((scores, estimates));
    };
    let poses = read_tum(&file)?;
    let stamps_ns: Vec<u64> = poses.iter().map(|pose| pose.stamp_ns).collect();
    let association = associate(&stamps_ns, &truth.frame_stamps_ns);
    for (pose, frame) in poses.iter().zip(&association.frames) {
        if let Some(frame) = *frame {
            estimates[frame] = Some(pose.world_from_camera);
        }
    }
    let matched = estimates.iter().flatten().count();
    let stamps = match association.clock {
        Clock::Absolute => "absolute",
        Clock::Relative => "relative",
        Clock::Unknown => "none",
    };
    scores.poses = Some(PoseCounts { read: poses.len(), matched, stamps });
    if truth.pose_count() == 0 {
        notes.missing.push("truth: poses".into());
        return Ok((scores, estimates));
    }
    compare(&estimates, truth, &mut scores);
    Ok((scores, estimates))
}

fn compare(estimates: &[Option<Pose>], truth: &Truth<'_>, scores: &mut TrajectoryScores) {
    let truths: Vec<_> = (0..estimates.len()).map(|frame| truth.world_from_camera(frame)).collect();
    let (found, real): (Vec<Pose>, Vec<Pose>) =
        estimates.iter().zip(&truths).filter_map(|(&estimate, &truth)| estimate.zip(truth)).unzip();
    scores.tracked = Some(found.len() as f64 / truth.pose_count() as f64);
    let Some(absolute) = ate(&found, &real) else { return };
    scores.ate_rmse_mm = Some(absolute.rmse_m * MM_PER_M);
    scores.ate_max_mm = Some(absolute.max_m * MM_PER_M);
    scores.ate_unaligned_rmse_mm = Some(absolute.unaligned_rmse_m * MM_PER_M);
    scores.scale = Some(absolute.scale);
    scores.path_mm = Some(path_length_m(&real) * MM_PER_M);
    if let Some(relative) = rpe(estimates, &truths) {
        scores.rpe_trans_mm = Some(relative.translation_rmse_m * MM_PER_M);
        scores.rpe_rot_deg = Some(relative.rotation_rmse_rad.to_degrees());
    }
    let last = found.len() - 1;
    let (end_m, end_rad) = pose_error(&(found[0], found[last]), &(real[0], real[last]));
    scores.end_error_mm = Some(end_m * MM_PER_M);
    scores.end_error_deg = Some(end_rad.to_degrees());
}
