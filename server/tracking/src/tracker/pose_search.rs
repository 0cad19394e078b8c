//! The ways to a frame's pose, from the likely to the laborious. Each ends with a search of the local map, which decides.

use std::sync::Arc;

use geometry::{Pose, StereoRig};
use nalgebra::Point3;

use crate::config::TrackingConfig;
use crate::frame::FrameFeatures;
use crate::local_mapping::PosedFrame;
use crate::map::{Keyframe, KeyframeId, Map, PointId, local_map};
use crate::matching::brute_force::mutual_matches;
use crate::matching::projection::{Found, ProjectionSearch};
use crate::report::PoseSource;
use crate::solve::absolute_pose::find_pose;
use crate::solve::pose::{PoseEstimate, refine_pose};
use crate::solve::reprojection::PointObservation;

/// A frame of unknown pose.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) stamp_ns: u64,
    pub(super) features: &'a Arc<FrameFeatures>,
}

/// A frame whose pose was found.
#[derive(Debug)]
pub(super) struct Located {
    pub(super) posed: PosedFrame,
    pub(super) source: PoseSource,
    /// The keyframe that shares most points with it; `None` for the first frame.
    pub(super) reference: Option<KeyframeId>,
    /// Local map points that the camera should see.
    pub(super) expected: Vec<PointId>,
    /// Those found, whether or not they fit the pose.
    pub(super) matched: usize,
}

impl Located {
    /// Matches that fit the pose.
    pub(super) fn inliers(&self) -> usize {
        self.posed.matches.iter().flatten().count()
    }
}

/// What all searches read.
#[derive(Clone, Copy)]
pub(super) struct PoseSearch<'a> {
    pub(super) config: &'a TrackingConfig,
    pub(super) rig: &'a StereoRig,
    pub(super) scales: &'a [f32],
    pub(super) map: &'a Map,
}

impl PoseSearch<'_> {
    /// Looks for the last frame's points where a predicted pose puts them, first in the narrow, then in the wide window.
    pub(super) fn from_motion(&self, frame: Frame, last: &PosedFrame, predicted: &Pose) -> Option<Located> {
        let search = &self.config.search;
        let windows = [
            (search.motion_radius_px, PoseSource::MotionModel, predicted),
            (search.wide_radius_px, PoseSource::WideSearch, predicted),
            (search.wide_radius_px, PoseSource::WideSearch, &last.camera_from_world),
        ];
        windows.into_iter().find_map(|(radius_px, source, start)| {
            let points = last.matches.iter().flatten().copied();
            let found = self.projection(radius_px).run(frame.features, self.map, points, start);
            let (_, first) = self.estimate(frame.features, &found.matches, start)?;
            self.against_local_map(frame, &first, source, self.config.recovery.inliers_min)
        })
    }

    /// Looks for a keyframe's features anywhere in the frame.
    pub(super) fn from_keyframe(&self, frame: Frame, id: KeyframeId, source: PoseSource) -> Option<Located> {
        let keyframe = self.map.keyframe(id)?;
        let search = &self.config.search;
        let pairs = mutual_matches(
            &keyframe.frame.features.descriptors,
            &frame.features.features.descriptors,
            search.distance_max_bits,
            search.brute_force_ratio,
        );
        let world_from_keyframe = keyframe.camera_from_world.inverse();
        let mut points = Vec::new();
        let mut matches = vec![None; frame.features.len()];
        for (theirs, ours) in pairs {
            let mapped = keyframe.points()[theirs];
            let position = mapped.and_then(|id| Some(self.map.point(id)?.position_in_world));
            let measured = || keyframe.frame.point_in_world(theirs, self.rig, &world_from_keyframe);
            let Some(point_in_world) = position.or_else(measured) else { continue };
            points.push(self.point_observation(point_in_world, frame.features, ours));
            matches[ours] = mapped;
        }
        let estimate = find_pose(self.rig, &points, &self.config.pose, &self.config.recovery)?;
        let inliers_min = match source {
            PoseSource::Relocalisation => self.config.recovery.recovery_inliers_min,
            _ => self.config.recovery.inliers_min,
        };
        let first = FirstEstimate { camera_from_world: estimate.camera_from_world, matches };
        self.against_local_map(frame, &first, source, inliers_min)
    }

    /// Looks for all points that keyframes around the first matches see, close to where the pose puts them.
    fn against_local_map(
        &self,
        frame: Frame,
        first: &FirstEstimate,
        source: PoseSource,
        inliers_min: u32,
    ) -> Option<Located> {
        let keyframes = self.config.map.local_keyframes as usize;
        let local = local_map(self.map, first.matches.iter().flatten().copied(), keyframes);
        let start = &first.camera_from_world;
        let search = self.projection(self.config.search.map_radius_px);
        let Found { matches, expected } =
            search.run(frame.features, self.map, local.points.into_iter(), start);
        let (matched, fit) = self.estimate(frame.features, &matches, start)?;
        let posed = PosedFrame {
            stamp_ns: frame.stamp_ns,
            camera_from_world: fit.camera_from_world,
            frame: Arc::clone(frame.features),
            matches: fit.matches,
        };
        let located = Located { posed, source, reference: local.reference, expected, matched };
        (located.inliers() >= inliers_min as usize).then_some(located)
    }

    /// Refines a pose on matches and keeps those that fit; also the number there were.
    fn estimate(
        &self,
        features: &FrameFeatures,
        matches: &[Option<PointId>],
        start: &Pose,
    ) -> Option<(usize, FirstEstimate)> {
        let mut matched = Vec::new();
        let mut points = Vec::new();
        for (feature, id) in matches.iter().enumerate() {
            let Some(point) = id.and_then(|id| self.map.point(id)) else { continue };
            matched.push(feature);
            points.push(self.point_observation(point.position_in_world, features, feature));
        }
        let first_inliers_min = self.config.recovery.first_inliers_min as usize;
        if points.len() < first_inliers_min {
            return None;
        }
        let estimate: PoseEstimate = refine_pose(self.rig, start, &points, &self.config.pose);
        let mut kept = vec![None; matches.len()];
        for (&feature, _) in matched.iter().zip(&estimate.inliers).filter(|(_, inlier)| **inlier) {
            kept[feature] = matches[feature];
        }
        let fit = FirstEstimate { camera_from_world: estimate.camera_from_world, matches: kept };
        (estimate.inlier_count() >= first_inliers_min).then_some((matched.len(), fit))
    }

    fn point_observation(
        &self,
        point_in_world: Point3<f64>,
        features: &FrameFeatures,
        feature: usize,
    ) -> PointObservation {
        let observation = features.observation(feature, self.scales, &self.config.pose);
        PointObservation { point_in_world, observation }
    }

    fn projection(&self, radius_px: f32) -> ProjectionSearch<'_> {
        ProjectionSearch { rig: self.rig, config: &self.config.search, scales: self.scales, radius_px }
    }
}

/// A pose and the matches behind it.
struct FirstEstimate {
    camera_from_world: Pose,
    matches: Vec<Option<PointId>>,
}

/// Keyframes to try for a frame that nothing else explains: the newest, then older ones in turns by attempt.
pub(super) fn relocalisation_candidates(map: &Map, attempt: u64, count: usize) -> Vec<KeyframeId> {
    let newest_first: Vec<KeyframeId> = map.keyframes().rev().map(|(id, _): (_, &Keyframe)| id).collect();
    let Some((&newest, older)) = newest_first.split_first() else { return Vec::new() };
    let taken = count.saturating_sub(1).min(older.len());
    let start = if older.is_empty() { 0 } else { (attempt as usize).wrapping_mul(taken) % older.len() };
    std::iter::once(newest).chain((0..taken).map(|step| older[(start + step) % older.len()])).collect()
}
