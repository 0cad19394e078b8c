//! What a new keyframe gives to do beside tracking: on a copy of its surroundings, so that tracking goes on meanwhile.

use geometry::{Pose, StereoRig};

use super::edit::{Edit, apply};
use super::window::Window;
use super::{adjustment, fusion, triangulation};
use crate::config::TrackingConfig;
use crate::loop_closing::{LoopClosure, Suspicion};
use crate::map::{KeyframeId, Map, PointId, excerpt};

/// A keyframe and a copy of its surroundings.
#[derive(Clone, Debug)]
pub struct Work {
    newest: KeyframeId,
    window: Window,
    part: Map,
    suspicion: Option<Suspicion>,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// The keyframe that it was about.
    pub newest: KeyframeId,
    /// That keyframe's pose before.
    pub pose_before: Pose,
    /// Changes to carry out.
    pub edits: Vec<Edit>,
    /// The loop that the keyframe closes.
    pub closure: Option<LoopClosure>,
}

/// What all of mapping reads.
#[derive(Clone, Debug)]
pub struct MappingContext {
    /// The cameras.
    pub rig: StereoRig,
    /// Full-size pixels per pixel of each pyramid level.
    pub scales: Vec<f32>,
    /// Options.
    pub config: TrackingConfig,
}

impl Work {
    /// The work that a keyframe gives; `None` where it is gone.
    pub fn around(
        map: &Map,
        newest: KeyframeId,
        suspicion: Option<Suspicion>,
        config: &TrackingConfig,
    ) -> Option<Self> {
        map.keyframe(newest)?;
        let window = Window::around(map, newest, &config.mapping);
        let part = excerpt(map, &window.all(), window.free.len());
        Some(Self { newest, window, part, suspicion })
    }

    /// New points from two views, duplicates merged, poses and points adjusted.
    pub fn carry_out(mut self, context: &MappingContext) -> Option<Finished> {
        let pose_before = self.part.keyframe(self.newest)?.camera_from_world;
        let mut edits = Vec::new();
        let mut made = Vec::new();
        let neighbours: Vec<KeyframeId> = self.window.free.iter().skip(1).copied().collect();
        let count = context.config.mapping.neighbours as usize;
        for &neighbour in neighbours.iter().take(count) {
            let pair = (self.newest, neighbour);
            let rig = (&context.rig, context.scales.as_slice());
            let found = triangulation::triangulate(&self.part, pair, rig, &context.config);
            self.carry_on(found, &mut edits, &mut made, context);
        }
        let points = fusion::points_made_by(&self.part, self.newest);
        for &neighbour in neighbours.iter().take(count) {
            let rig = (&context.rig, context.scales.as_slice());
            let found = fusion::fuse(&self.part, &points, neighbour, rig, &context.config);
            self.carry_on(fusion::resolve_chains(found), &mut edits, &mut made, context);
        }
        let adjusted =
            adjustment::adjust(&self.part, &self.window, &context.rig, &context.scales, &context.config);
        edits.extend(adjusted);
        let keyframe = self.part.keyframe(self.newest)?;
        let closure = self.suspicion.and_then(|suspicion| suspicion.prove(self.newest, keyframe, context));
        Some(Finished { newest: self.newest, pose_before, edits, closure })
    }

    fn carry_on(
        &mut self,
        found: Vec<Edit>,
        edits: &mut Vec<Edit>,
        made: &mut Vec<Option<PointId>>,
        context: &MappingContext,
    ) {
        apply(&mut self.part, &found, made, &context.scales);
        edits.extend(found);
    }
}

impl Finished {
    /// Carries the edits out, and moves what came after the keyframe as the keyframe was moved. Gives the motion of the
    /// world there: multiply poses (`camera_from_world`) by it from the right.
    pub fn apply(&self, map: &mut Map, scales: &[f32]) -> Pose {
        apply(map, &self.edits, &mut Vec::new(), scales);
        // gone with a map that was forgotten meanwhile
        let Some(newest) = map.keyframe(self.newest) else { return Pose::identity() };
        let correction = self.pose_before.inverse() * newest.camera_from_world;
        map.move_newer_than(self.newest, &correction);
        correction
    }

    /// The point that another was merged into.
    pub fn successor(&self, id: PointId) -> PointId {
        let step = |id: PointId, edit: &Edit| match edit {
            Edit::Merge { kept, duplicate } if *duplicate == id => *kept,
            _ => id,
        };
        self.edits.iter().fold(id, step)
    }
}
