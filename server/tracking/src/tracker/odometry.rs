//! Stereo odometry, `tracking.mode = "odometry"`: from frame to frame, with nothing remembered. And no tracking at all,
//! `tracking.mode = "none"`. Both are there to be compared with (the paper's "Comparisons with global pose estimation strategy").

use std::sync::Arc;

use geometry::Pose;

use super::pose_search::Frame;
use super::{State, Track, Tracker, Verdict};
use crate::config::TrackingMode;
use crate::local_mapping::{PosedFrame, insert_keyframe};
use crate::map::KeyframeId;
use crate::report::{Outcome, TrackingReport, TrackingStatistics};

impl Tracker {
    pub(super) fn is_odometry(&self) -> bool {
        self.config.mode == TrackingMode::Odometry
    }

    /// The map becomes this frame: its stereo points, and nothing else.
    pub(super) fn restart_map(&mut self, posed: &mut PosedFrame) -> KeyframeId {
        let older: Vec<KeyframeId> = self.map.keyframes().map(|(id, _)| id).collect();
        posed.matches.fill(None);
        let id = insert_keyframe(&mut self.map, posed, &self.rig, &self.config.map);
        for id in older {
            self.map.remove_keyframe(id);
        }
        if let Some(keyframe) = self.map.keyframe(id) {
            posed.matches = keyframe.points().to_vec();
        }
        id
    }

    /// Odometry has lost its way: it goes on from this frame, if that shows enough, as if the camera had not moved since.
    pub(super) fn go_on_from(&mut self, frame: Frame, mut track: Track) -> (State, Verdict) {
        let since_ns = *track.lost_since_ns.get_or_insert(frame.stamp_ns);
        if frame.features.stereo_count() >= self.config.recovery.initial_points_min as usize {
            let mut posed = PosedFrame {
                stamp_ns: frame.stamp_ns,
                camera_from_world: track.last.camera_from_world,
                frame: Arc::clone(frame.features),
                resting: false,
                matches: vec![None; frame.features.len()],
            };
            let reference = self.restart_map(&mut posed);
            let lost_since_ns = track.lost_since_ns;
            track = Track { last: posed, velocity: None, reference, frames_since_keyframe: 1, lost_since_ns };
        }
        (State::Tracking(track), Outcome::Lost { since_ns }.into())
    }

    /// The camera is said not to move, and nothing is looked at.
    pub(super) fn unmoving(&self) -> TrackingReport {
        TrackingReport {
            outcome: Outcome::Tracked,
            world_from_camera: Some(Pose::identity()),
            source: None,
            features: Vec::new(),
            statistics: TrackingStatistics::default(),
            keyframe: None,
            drift: self.drift,
            correction: None,
        }
    }
}
