//! The way back for a tracker that is lost.

use super::pose_search::{Frame, Located};
use super::{State, Tracker};
use crate::frame::FrameFeatures;
use crate::map::{KeyframeId, Map};
use crate::relocalization::candidates;
use crate::report::{CorrectionKind, KeyframeCorrection, MapCorrection, PoseSource};

impl Tracker {
    /// Compares the frame with the newest keyframe, with those that look like it, and with older ones in turns.
    pub(super) fn relocalise(&self, frame: Frame, attempt: u64) -> Option<Located> {
        let search = self.pose_search();
        self.views_to_try(frame.features, attempt)
            .into_iter()
            .filter_map(|id| self.map.keyframe(id))
            .find_map(|keyframe| search.by_view(frame, keyframe.into(), PoseSource::Relocalisation))
    }

    fn views_to_try(&self, features: &FrameFeatures, attempt: u64) -> Vec<KeyframeId> {
        let config = &self.config.recognition;
        let similar = candidates(
            &self.places,
            &self.map,
            &features.features.descriptors,
            config.distance_max_bits,
            |_| true,
        );
        let mut views: Vec<KeyframeId> =
            self.map.keyframes().next_back().map(|(id, _)| id).into_iter().collect();
        let recognised =
            similar.into_iter().take(config.candidates as usize).map(|candidate| candidate.keyframe);
        for id in recognised.chain(older_in_turn(&self.map, attempt)) {
            if !views.contains(&id) {
                views.push(id);
            }
        }
        views
    }

    /// Where the camera has been lost for too long for what the map is worth, the frame is the first of a new one.
    pub(super) fn begin_anew(&mut self, frame: Frame, attempts: u64) -> Option<Located> {
        self.is_map_useless(frame.features, attempts).then(|| self.forget_map())?;
        self.first_frame(frame)
    }

    /// Whether the map is too young to be worth waiting for: what began it may have been no tissue at all.
    fn is_map_useless(&self, features: &FrameFeatures, attempts: u64) -> bool {
        let config = &self.config.recovery;
        self.map.keyframe_count() <= config.restart_keyframes_max as usize
            && attempts >= u64::from(config.restart_frames)
            && features.stereo_count() >= config.initial_points_min as usize
    }

    /// Forgets the map; the next pose is the world's.
    fn forget_map(&mut self) {
        self.map.clear();
        self.places = crate::relocalization::PlaceIndex::new();
        self.unmapped = None;
        self.state = State::NotInitialized;
        self.correction = Some(MapCorrection { kind: CorrectionKind::Restart, keyframes: Vec::new() });
    }

    /// Tells how far the camera was from where it was last seen.
    pub(super) fn note_relocalisation(&mut self, located: &Located, last_seen: &geometry::Pose) {
        let correction = KeyframeCorrection {
            stamp_ns: located.posed.stamp_ns,
            world_from_camera_before: last_seen.inverse(),
            world_from_camera_after: located.posed.camera_from_world.inverse(),
        };
        let kind = CorrectionKind::Relocalization;
        self.correction = Some(MapCorrection { kind, keyframes: vec![correction] });
    }
}

/// An older keyframe, another one at each attempt.
fn older_in_turn(map: &Map, attempt: u64) -> Option<KeyframeId> {
    let count = map.keyframe_count() as u64;
    let turn = attempt.checked_rem(count)? as usize;
    map.keyframes().nth(turn).map(|(id, _)| id)
}
