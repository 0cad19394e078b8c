//! A frame that stays in the map.

use std::sync::Arc;

use geometry::Pose;

use super::PointId;
use crate::feature::Descriptor;
use crate::frame::FrameFeatures;

/// Names a keyframe; later ones are greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct KeyframeId(pub(super) u64);

impl KeyframeId {
    /// Keyframes made between two ids.
    pub fn age(self, newer: Self) -> u64 {
        newer.0.saturating_sub(self.0)
    }
}

#[cfg(test)]
impl KeyframeId {
    pub(crate) fn of(number: u64) -> Self {
        Self(number)
    }
}

/// A frame with its pose and the map points that it sees.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// When it was taken.
    pub stamp_ns: u64,
    /// Where from.
    pub camera_from_world: Pose,
    /// Its features.
    pub frame: Arc<FrameFeatures>,
    /// Whether the camera was found not to have moved, so that its pose is not to be adjusted.
    pub resting: bool,
    /// Map point of each feature; only the map changes these.
    pub(super) points: Vec<Option<PointId>>,
    /// The older keyframe that it hangs on in the spanning tree; only the map changes it.
    pub(super) parent: Option<KeyframeId>,
}

impl Keyframe {
    pub(super) fn new(stamp_ns: u64, camera_from_world: Pose, frame: Arc<FrameFeatures>) -> Self {
        let points = vec![None; frame.len()];
        Self { stamp_ns, camera_from_world, frame, resting: false, points, parent: None }
    }

    /// Map point of each feature.
    pub fn points(&self) -> &[Option<PointId>] {
        &self.points
    }

    /// The older keyframe that it hangs on in the spanning tree; none for a root.
    pub fn parent(&self) -> Option<KeyframeId> {
        self.parent
    }

    /// Descriptors of the features that see a map point.
    pub fn mapped_descriptors(&self) -> Vec<Descriptor> {
        let descriptors = &self.frame.features.descriptors;
        self.points
            .iter()
            .zip(descriptors)
            .filter_map(|(point, descriptor)| point.map(|_| *descriptor))
            .collect()
    }

    /// Number of map points seen.
    pub fn point_count(&self) -> usize {
        self.points.iter().flatten().count()
    }
}
