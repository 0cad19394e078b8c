//! `tracking.csv`: what the tracker made of each pair, for whoever wonders why it did what it did.

use serde::Serialize;
use tracking::{CorrectionKind, KeyframeReason, MapCorrection, Outcome, PoseSource};

use crate::session::worker::TrackedPair;

/// One pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackingRow {
    /// Pair number in the recording.
    pub frame: u64,
    /// Time stamp, nanoseconds.
    pub stamp_ns: u64,
    /// What is known after it.
    pub outcome: &'static str,
    /// How the pose was found; empty where there is none.
    pub source: Option<&'static str>,
    /// Left features.
    pub features: usize,
    /// Of them with a depth.
    pub stereo_points: usize,
    /// Map points found.
    pub matches: usize,
    /// Of them those that fit the pose.
    pub inliers: usize,
    /// Features followed on tissue that deforms.
    pub deforming: usize,
    /// Keyframes in the map.
    pub keyframes: usize,
    /// Points in the map.
    pub map_points: usize,
    /// Why it became a keyframe; empty where it did not.
    pub keyframe: Option<&'static str>,
    /// What became of the map besides; mostly empty.
    pub correction: Option<&'static str>,
    /// How far that moved the camera, millimetres.
    pub correction_mm: Option<f64>,
}

impl TrackingRow {
    pub(super) fn new(pair: &TrackedPair) -> Self {
        let report = &pair.report;
        let (counts, correction) = (&report.statistics, report.correction.as_ref());
        let deforms =
            |feature: &&tracking::TrackedFeature| feature.motion.is_some_and(|motion| !motion.rigid);
        Self {
            frame: pair.sequence,
            stamp_ns: pair.stamp_ns,
            outcome: outcome_name(report.outcome),
            source: report.source.map(source_name),
            features: counts.left_features,
            stereo_points: counts.stereo_points,
            matches: counts.matches,
            inliers: counts.inliers,
            deforming: report.features.iter().filter(deforms).count(),
            keyframes: counts.keyframes,
            map_points: counts.map_points,
            keyframe: report.keyframe.map(reason_name),
            correction: correction.map(|correction| correction_name(correction.kind)),
            correction_mm: correction.and_then(moved_mm),
        }
    }
}

fn outcome_name(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::NotInitialized => "not_initialized",
        Outcome::Tracked => "tracked",
        Outcome::Recovered => "recovered",
        Outcome::Lost { .. } => "lost",
    }
}

fn correction_name(kind: CorrectionKind) -> &'static str {
    match kind {
        CorrectionKind::Loop => "loop",
        CorrectionKind::Relocalization => "relocalization",
        CorrectionKind::Restart => "restart",
    }
}

fn moved_mm(correction: &MapCorrection) -> Option<f64> {
    let newest = correction.keyframes.last()?;
    let way = newest.world_from_camera_after.translation.vector
        - newest.world_from_camera_before.translation.vector;
    Some(1e3 * way.norm())
}

fn source_name(source: PoseSource) -> &'static str {
    match source {
        PoseSource::FirstFrame => "first_frame",
        PoseSource::Standstill => "standstill",
        PoseSource::MotionModel => "motion_model",
        PoseSource::WideSearch => "wide_search",
        PoseSource::LastFrame => "last_frame",
        PoseSource::ReferenceKeyframe => "reference_keyframe",
        PoseSource::Relocalisation => "relocalisation",
    }
}

fn reason_name(reason: KeyframeReason) -> &'static str {
    match reason {
        KeyframeReason::First => "first",
        KeyframeReason::FewTracked => "few_tracked",
        KeyframeReason::Motion => "motion",
        KeyframeReason::Rotation => "rotation",
        KeyframeReason::Recovery => "recovery",
        KeyframeReason::Odometry => "odometry",
    }
}
