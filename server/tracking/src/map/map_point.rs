//! A point of the map.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::{Keyframe, KeyframeId};
use crate::feature::Descriptor;

/// Names a point; later ones are greater.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PointId(pub(super) u64);

/// A sighting: which feature of which keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The keyframe.
    pub keyframe: KeyframeId,
    /// Index of its feature.
    pub feature: usize,
}

/// A point, and what is needed to find it again.
#[derive(Clone, Debug)]
pub struct MapPoint {
    /// Where it is.
    pub position_in_world: Point3<f64>,
    /// The sighting descriptor nearest to all others.
    pub descriptor: Descriptor,
    /// Mean unit vector from the cameras to the point.
    pub view_direction: Vector3<f64>,
    /// Distance at which it would appear on the finest pyramid level.
    pub finest_distance_m: f64,
    /// Keyframe that made it.
    pub created_in: KeyframeId,
    /// Frames that should have shown it.
    pub expected: u32,
    /// Frames that did, consistently with their pose.
    pub found: u32,
    /// Running mean of the squared whitened residual per degree of freedom: large for points on moving tissue.
    pub misfit: f64,
    /// Sightings, oldest first; only the map changes these.
    pub(super) seen: Vec<Seen>,
}

impl MapPoint {
    pub(super) fn new(position_in_world: Point3<f64>, seen: Seen, keyframe: &Keyframe) -> Self {
        let descriptor = keyframe.frame.features.descriptors[seen.feature];
        let view = position_in_world - keyframe.camera_from_world.inverse_transform_point(&Point3::origin());
        Self {
            position_in_world,
            descriptor,
            view_direction: view.normalize(),
            finest_distance_m: view.norm(),
            created_in: seen.keyframe,
            expected: 1,
            found: 1,
            misfit: MISFIT_AT_FIRST,
            seen: vec![seen],
        }
    }

    /// Sightings, oldest first.
    pub fn seen(&self) -> &[Seen] {
        &self.seen
    }

    /// Share of the frames that should have shown it and did.
    pub fn found_share(&self) -> f64 {
        f64::from(self.found) / f64::from(self.expected.max(1))
    }

    /// Factor on the point's information in pose estimation, 1 for one that never moved.
    ///
    /// Tissue that moves as one could outvote what stands still; but the still points have fitted for long. A point is trusted as far
    /// as it has fitted before, so that those keep the camera where it is.
    pub fn trust(&self) -> f64 {
        trust_of(self.misfit)
    }

    /// Adds a sighting's squared whitened residual per degree of freedom to the running mean.
    pub fn observe_misfit(&mut self, misfit: f64) {
        self.misfit += MISFIT_RATE * (misfit.min(MISFIT_MAX) - self.misfit);
    }

    pub(super) fn summarise(&mut self, keyframes: &BTreeMap<KeyframeId, Keyframe>, scales: &[f32]) {
        let sightings: Vec<(&Keyframe, usize)> = self
            .seen
            .iter()
            .filter_map(|seen| Some((keyframes.get(&seen.keyframe)?, seen.feature)))
            .collect();
        let Some((newest, feature)) = sightings.last() else { return };
        let view = |keyframe: &Keyframe| {
            self.position_in_world - keyframe.camera_from_world.inverse_transform_point(&Point3::origin())
        };
        let level = usize::from(newest.frame.features.keypoints[*feature].level);
        self.finest_distance_m = view(newest).norm() * f64::from(scales[level]);
        let directions = sightings.iter().map(|(keyframe, _)| view(keyframe).normalize());
        self.view_direction = directions.sum::<Vector3<f64>>().normalize();
        let descriptors: Vec<Descriptor> = sightings
            .iter()
            .rev()
            .take(DESCRIPTORS_COMPARED)
            .map(|(keyframe, feature)| keyframe.frame.features.descriptors[*feature])
            .collect();
        self.descriptor = medoid(&descriptors);
    }
}

/// What a new point is taken to have: it is not known yet whether it stands still.
const MISFIT_AT_FIRST: f64 = 3.0;
/// Share of the newest residual in the running mean.
const MISFIT_RATE: f64 = 0.1;
/// Larger ones are outliers whatever their size.
const MISFIT_MAX: f64 = 30.0;
/// Measurement noise alone gives residuals of this order, which say nothing about motion.
const MISFIT_OF_NOISE: f64 = 0.3;

fn trust_of(misfit: f64) -> f64 {
    MISFIT_OF_NOISE / (MISFIT_OF_NOISE + misfit)
}

/// Factor on the information of a point that was measured once.
pub fn trust_at_first() -> f64 {
    trust_of(MISFIT_AT_FIRST)
}

/// Latest descriptors among which the representative one is chosen.
const DESCRIPTORS_COMPARED: usize = 7;

/// The descriptor with the least sum of distances to the others; of equals the first. There must be one.
fn medoid(descriptors: &[Descriptor]) -> Descriptor {
    let total = |a: &Descriptor| descriptors.iter().map(|b| a.distance(b)).sum::<u32>();
    *descriptors.iter().min_by_key(|descriptor| total(descriptor)).expect("a point has a sighting")
}
