//! The tracker's side of mapping: it hands keyframes over and takes results back, between frames.

use geometry::Pose;

use super::{State, Tracker};
use crate::TrackingError;
use crate::local_mapping::{self, Finished, PosedFrame, Work};

impl Tracker {
    /// Carries out what mapping has found by now.
    pub(super) fn take_mapping(&mut self) -> Result<(), TrackingError> {
        if let Some(finished) = self.mapper.due(self.frame_number)? {
            let correction = finished.apply(&mut self.map, &self.scales);
            if let State::Tracking(track) = &mut self.state {
                follow_correction(&mut track.last, &finished, &correction);
            }
            local_mapping::cull_redundant(&mut self.map, finished.newest, &self.config.mapping);
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
        match Work::around(&self.map, newest, &self.config) {
            Some(work) => self.mapper.begin(work, self.frame_number),
            None => Ok(()),
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
