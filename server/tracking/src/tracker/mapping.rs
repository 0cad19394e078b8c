//! The tracker's side of mapping: it hands keyframes over and takes results back, between frames.

use geometry::Pose;

use super::{State, Tracker};
use crate::TrackingError;
use crate::local_mapping::{self, Finished, PosedFrame, Work};
use crate::loop_closing::{self, LoopClosure};
use crate::report::{CorrectionKind, MapCorrection};

impl Tracker {
    /// Carries out what mapping has found by now.
    pub(super) fn take_mapping(&mut self) -> Result<(), TrackingError> {
        if let Some(finished) = self.mapper.due(self.frame_number)? {
            let correction = finished.apply(&mut self.map, &self.scales);
            if let State::Tracking(track) = &mut self.state {
                follow_correction(&mut track.last, &finished, &correction);
            }
            if let Some(closure) = &finished.closure {
                self.close_loop(closure);
            }
            local_mapping::cull_redundant(&mut self.map, finished.newest, &self.config.mapping);
            self.index_places();
        }
        Ok(())
    }

    /// Hands the newest keyframe over, unless mapping is still busy with an older one; it then waits, and a still newer one takes its
    /// place.
    pub(super) fn give_mapping(&mut self) -> Result<(), TrackingError> {
        if !self.mapper.is_idle() {
            return Ok(());
        }
        let Some(newest) = self.unmapped.take() else { return Ok(()) };
        let suspicion = loop_closing::suspect(&self.map, &self.places, newest, &self.config);
        match Work::around(&self.map, newest, suspicion, &self.config) {
            Some(work) => self.mapper.begin(work, self.frame_number),
            None => Ok(()),
        }
    }

    /// Takes the drift out of map and camera, and has the new keyframe adjusted to its new neighbours.
    fn close_loop(&mut self, closure: &LoopClosure) {
        let Some(before) = self.map.keyframe(closure.keyframe).map(|keyframe| keyframe.camera_from_world)
        else {
            return;
        };
        let keyframes = loop_closing::close(&mut self.map, closure, &self.mapping);
        let Some(after) = self.map.keyframe(closure.keyframe).map(|keyframe| keyframe.camera_from_world)
        else {
            return;
        };
        if let State::Tracking(track) = &mut self.state {
            track.last.camera_from_world *= before.inverse() * after;
        }
        if !keyframes.is_empty() {
            self.correction = Some(MapCorrection { kind: CorrectionKind::Loop, keyframes });
        }
        self.unmapped.get_or_insert(closure.keyframe);
    }

    /// Makes mapped keyframes recognisable, and forgets removed ones.
    fn index_places(&mut self) {
        self.places.retain(|id| self.map.keyframe(id).is_some());
        for (id, keyframe) in self.map.keyframes() {
            self.places.insert(id, || keyframe.mapped_descriptors());
        }
    }

    /// Notes that a keyframe is to be mapped; one that still waits is passed over and counted.
    pub(super) fn queue_mapping(&mut self, keyframe: crate::map::KeyframeId) {
        if self.unmapped.replace(keyframe).is_some() {
            self.keyframes_passed_over += 1;
        }
    }
}

/// Moves the last frame with the world around it, and calls its points by their new names.
fn follow_correction(last: &mut PosedFrame, finished: &Finished, correction: &Pose) {
    last.camera_from_world *= correction;
    for id in last.matches.iter_mut().flatten() {
        *id = finished.successor(*id);
    }
}
