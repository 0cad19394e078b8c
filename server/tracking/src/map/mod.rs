//! The sparse map: keyframes, points, and which keyframe sees which point.
//!
//! [`Map`] alone changes links between points and keyframes, so both directions always agree.

mod covisibility;
mod excerpt;
mod keyframe;
mod map_point;
mod spanning_tree;

pub use covisibility::{LocalMap, covisible, local_map};
pub use excerpt::excerpt;
pub use keyframe::{Keyframe, KeyframeId};
pub use map_point::{MapPoint, PointId, Seen, trust_at_first};

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::Pose;
use nalgebra::Point3;

use crate::frame::FrameFeatures;

/// Keyframes and points by id; ids grow and are never used again.
#[derive(Clone, Debug, Default)]
pub struct Map {
    keyframes: BTreeMap<KeyframeId, Keyframe>,
    points: BTreeMap<PointId, MapPoint>,
    next_keyframe: u64,
    next_point: u64,
    /// Pairs of keyframes, new and old, that closed a loop.
    loops: Vec<(KeyframeId, KeyframeId)>,
}

impl Map {
    /// All keyframes, oldest first.
    pub fn keyframes(&self) -> impl DoubleEndedIterator<Item = (KeyframeId, &Keyframe)> {
        self.keyframes.iter().map(|(id, keyframe)| (*id, keyframe))
    }

    /// All points, oldest first.
    pub fn points(&self) -> impl Iterator<Item = (PointId, &MapPoint)> {
        self.points.iter().map(|(id, point)| (*id, point))
    }

    /// Number of keyframes.
    pub fn keyframe_count(&self) -> usize {
        self.keyframes.len()
    }

    /// Number of points.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// A keyframe, unless it was removed.
    pub fn keyframe(&self, id: KeyframeId) -> Option<&Keyframe> {
        self.keyframes.get(&id)
    }

    /// A point, unless it was removed.
    pub fn point(&self, id: PointId) -> Option<&MapPoint> {
        self.points.get(&id)
    }

    /// A point to be changed, unless it was removed.
    pub fn point_mut(&mut self, id: PointId) -> Option<&mut MapPoint> {
        self.points.get_mut(&id)
    }

    /// A keyframe's pose to be changed, unless it was removed.
    pub fn keyframe_pose_mut(&mut self, id: KeyframeId) -> Option<&mut Pose> {
        self.keyframes.get_mut(&id).map(|keyframe| &mut keyframe.camera_from_world)
    }

    /// Moves keyframes, and each point with the keyframe that made it or else with the oldest that sees it.
    pub fn move_keyframes(&mut self, camera_from_world: &BTreeMap<KeyframeId, Pose>) {
        let correction = |keyframe: &KeyframeId| {
            Some(camera_from_world.get(keyframe)?.inverse() * self.keyframes.get(keyframe)?.camera_from_world)
        };
        for point in self.points.values_mut() {
            let moved = correction(&point.created_in)
                .or_else(|| point.seen.iter().find_map(|seen| correction(&seen.keyframe)));
            if let Some(new_from_old) = moved {
                point.position_in_world = new_from_old * point.position_in_world;
                point.view_direction = new_from_old * point.view_direction;
            }
        }
        for (id, pose) in camera_from_world {
            if let Some(keyframe) = self.keyframes.get_mut(id) {
                keyframe.camera_from_world = *pose;
            }
        }
    }

    /// Notes that two keyframes closed a loop.
    pub fn note_loop(&mut self, newer: KeyframeId, older: KeyframeId) {
        self.loops.push((newer, older));
    }

    /// Pairs of keyframes, new and old, that closed a loop, as far as both are still there.
    pub fn loops(&self) -> impl Iterator<Item = (KeyframeId, KeyframeId)> {
        self.loops.iter().copied()
    }

    /// Forgets everything but which ids were given.
    pub fn clear(&mut self) {
        *self = Self { next_keyframe: self.next_keyframe, next_point: self.next_point, ..Self::default() };
    }

    /// Notes whether the camera was found not to have moved at a keyframe.
    pub fn set_resting(&mut self, id: KeyframeId, resting: bool) {
        if let Some(keyframe) = self.keyframes.get_mut(&id) {
            keyframe.resting = resting;
        }
    }

    /// Moves all keyframes newer than one, and the points that they made, as a correction of the world asks:
    /// `camera_from_world * correction`, `correction^-1 * point`.
    pub fn move_newer_than(&mut self, id: KeyframeId, correction: &Pose) {
        let after = (std::ops::Bound::Excluded(id), std::ops::Bound::Unbounded);
        for (_, keyframe) in self.keyframes.range_mut(after) {
            keyframe.camera_from_world *= correction;
        }
        for point in self.points.values_mut().filter(|point| point.created_in > id) {
            point.position_in_world = correction.inverse_transform_point(&point.position_in_world);
        }
    }

    /// Adds a keyframe that sees no points yet.
    pub fn add_keyframe(
        &mut self,
        stamp_ns: u64,
        camera_from_world: Pose,
        frame: Arc<FrameFeatures>,
    ) -> KeyframeId {
        let id = KeyframeId(self.next_keyframe);
        self.next_keyframe += 1;
        self.keyframes.insert(id, Keyframe::new(stamp_ns, camera_from_world, frame));
        id
    }

    /// Adds a point that `feature` of `keyframe` sees; `None` where the keyframe is gone or the feature taken.
    pub fn add_point(&mut self, position_in_world: Point3<f64>, seen: Seen) -> Option<PointId> {
        let slot = self.keyframes.get_mut(&seen.keyframe)?.points.get_mut(seen.feature)?;
        if slot.is_some() {
            return None;
        }
        let id = PointId(self.next_point);
        self.next_point += 1;
        *slot = Some(id);
        let keyframe = self.keyframes.get(&seen.keyframe)?;
        self.points.insert(id, MapPoint::new(position_in_world, seen, keyframe));
        Some(id)
    }

    /// Notes that a keyframe's feature sees a point; nothing happens where either is gone or already linked.
    pub fn link(&mut self, id: PointId, seen: Seen) {
        let (Some(point), Some(keyframe)) =
            (self.points.get_mut(&id), self.keyframes.get_mut(&seen.keyframe))
        else {
            return;
        };
        let Some(slot) = keyframe.points.get_mut(seen.feature) else { return };
        if slot.is_none() && point.seen.iter().all(|other| other.keyframe != seen.keyframe) {
            *slot = Some(id);
            point.seen.push(seen);
        }
    }

    /// Undoes [`Self::link`]; a point that nobody sees any more is removed.
    pub fn unlink(&mut self, id: PointId, keyframe: KeyframeId) {
        let Some(point) = self.points.get_mut(&id) else { return };
        let Some(place) = point.seen.iter().position(|seen| seen.keyframe == keyframe) else { return };
        let seen = point.seen.remove(place);
        if let Some(keyframe) = self.keyframes.get_mut(&keyframe) {
            keyframe.points[seen.feature] = None;
        }
        if self.points.get(&id).is_some_and(|point| point.seen.is_empty()) {
            self.points.remove(&id);
        }
    }

    /// Gives all sightings of `duplicate` to `kept`, except by keyframes that see both, and removes it.
    pub fn merge_points(&mut self, kept: PointId, duplicate: PointId) {
        if kept == duplicate || !self.points.contains_key(&kept) {
            return;
        }
        let Some(seen) = self.points.get(&duplicate).map(|point| point.seen.clone()) else { return };
        let (expected, found) = (self.points[&duplicate].expected, self.points[&duplicate].found);
        self.remove_point(duplicate);
        for sighting in seen {
            self.link(kept, sighting);
        }
        if let Some(point) = self.points.get_mut(&kept) {
            point.seen.sort_by_key(|seen| seen.keyframe);
            point.expected = point.expected.saturating_add(expected);
            point.found = point.found.saturating_add(found);
        }
    }

    /// Removes a point and all links to it.
    pub fn remove_point(&mut self, id: PointId) {
        let Some(point) = self.points.remove(&id) else { return };
        for seen in point.seen {
            if let Some(keyframe) = self.keyframes.get_mut(&seen.keyframe) {
                keyframe.points[seen.feature] = None;
            }
        }
    }

    /// Removes a keyframe, all links to it, and the points that no other keyframe sees.
    pub fn remove_keyframe(&mut self, id: KeyframeId) {
        let Some(keyframe) = self.keyframes.remove(&id) else { return };
        self.entrust_children(id, keyframe.parent);
        self.loops.retain(|(newer, older)| *newer != id && *older != id);
        for point_id in keyframe.points.into_iter().flatten() {
            if let Some(point) = self.points.get_mut(&point_id) {
                point.seen.retain(|seen| seen.keyframe != id);
                if point.seen.is_empty() {
                    self.points.remove(&point_id);
                }
            }
        }
    }

    /// Recomputes what a point's sightings say about its looks: descriptor, mean direction, range of distances.
    pub fn summarise_point(&mut self, id: PointId, scales: &[f32]) {
        if let Some(point) = self.points.get_mut(&id) {
            point.summarise(&self.keyframes, scales);
        }
    }
}
