//! The ways to a frame's pose, from the likely to the laborious. Each ends with a search of the local map, which decides.

use std::sync::Arc;

use geometry::{Pose, StereoRig};

use crate::config::TrackingConfig;
use crate::frame::FrameFeatures;
use crate::local_mapping::PosedFrame;
use crate::map::{Keyframe, KeyframeId, Map, PointId, local_map, trust_at_first};
use crate::matching::brute_force::mutual_matches;
use crate::matching::projection::{Found, ProjectionSearch};
use crate::report::PoseSource;
use crate::solve::absolute_pose::find_pose;
use crate::solve::pose::{PoseEstimate, refine_pose};
use crate::solve::reprojection::{PointObservation, inliers};
use crate::solve::standstill::still_share;

/// A frame of unknown pose.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub(crate) stamp_ns: u64,
    pub(crate) features: &'a Arc<FrameFeatures>,
}

/// An earlier frame of known pose, kept as a keyframe or not.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    camera_from_world: &'a Pose,
    features: &'a FrameFeatures,
    /// Map point of each feature.
    points: &'a [Option<PointId>],
}

impl<'a> From<&'a PosedFrame> for View<'a> {
    fn from(posed: &'a PosedFrame) -> Self {
        Self { camera_from_world: &posed.camera_from_world, features: &posed.frame, points: &posed.matches }
    }
}

impl<'a> From<&'a Keyframe> for View<'a> {
    fn from(keyframe: &'a Keyframe) -> Self {
        let (camera_from_world, features) = (&keyframe.camera_from_world, &keyframe.frame);
        Self { camera_from_world, features, points: keyframe.points() }
    }
}

/// A frame whose pose was found.
#[derive(Debug)]
pub(crate) struct Located {
    pub(crate) posed: PosedFrame,
    pub(crate) source: PoseSource,
    /// The keyframe that shares most points with it; `None` for the first frame.
    pub(crate) reference: Option<KeyframeId>,
    /// Local map points that the camera should see.
    pub(crate) expected: Vec<PointId>,
    /// Those found, and how badly each fits the pose.
    pub(crate) misfits: Vec<(PointId, f64)>,
}

impl Located {
    /// Matches that fit the pose.
    pub(crate) fn inliers(&self) -> usize {
        self.posed.matches.iter().flatten().count()
    }
}

/// What all searches read.
#[derive(Clone, Copy)]
pub(crate) struct PoseSearch<'a> {
    pub(crate) config: &'a TrackingConfig,
    pub(crate) rig: &'a StereoRig,
    pub(crate) scales: &'a [f32],
    pub(crate) map: &'a Map,
}

impl PoseSearch<'_> {
    /// Looks for the last frame's points where a predicted pose puts them, first in the narrow, then in the wide window.
    pub(crate) fn by_motion(&self, frame: Frame, last: &PosedFrame, predicted: &Pose) -> Option<Located> {
        let search = &self.config.search;
        let windows = [
            (search.motion_radius_px, PoseSource::MotionModel, predicted),
            (search.wide_radius_px, PoseSource::WideSearch, predicted),
            (search.wide_radius_px, PoseSource::WideSearch, &last.camera_from_world),
        ];
        windows.into_iter().find_map(|(radius_px, source, start)| {
            let points = last.matches.iter().flatten().copied();
            let mut first = self.first_estimate(frame, points, (start, radius_px), source)?;
            first.resting = Some(last.camera_from_world);
            self.against_local_map(frame, &first)
        })
    }

    /// Looks for an earlier view's features anywhere in the frame.
    pub(crate) fn by_view(&self, frame: Frame, view: View, source: PoseSource) -> Option<Located> {
        let search = &self.config.search;
        let pairs = mutual_matches(
            &view.features.features.descriptors,
            &frame.features.features.descriptors,
            search.distance_max_bits,
            search.brute_force_ratio,
        );
        let world_from_view = view.camera_from_world.inverse();
        let mut observations = Vec::new();
        for (theirs, ours) in pairs {
            let mapped = view.points[theirs].and_then(|id| self.map.point(id));
            let measured = || {
                let position = view.features.point_in_world(theirs, self.rig, &world_from_view)?;
                Some((position, trust_at_first()))
            };
            let known = mapped.map(|point| (point.position_in_world, point.trust()));
            let Some((point_in_world, trust)) = known.or_else(measured) else { continue };
            let observation = frame.features.observation(ours, self.scales, &self.config.pose);
            observations.push(PointObservation { point_in_world, observation, trust });
        }
        let start =
            find_pose(self.rig, &observations, &self.config.pose, &self.config.recovery)?.camera_from_world;
        let nearby = local_map(self.map, view.points.iter().flatten().copied(), self.local_keyframes());
        let points = nearby.points.into_iter();
        let first = self.first_estimate(frame, points, (&start, search.motion_radius_px), source)?;
        self.against_local_map(frame, &first)
    }

    /// A pose from points looked for in windows around where a guess puts them.
    fn first_estimate(
        &self,
        frame: Frame,
        points: impl Iterator<Item = PointId>,
        (start, radius_px): (&Pose, f32),
        source: PoseSource,
    ) -> Option<FirstEstimate> {
        let found = self.projection(radius_px).run(frame.features, self.map, points, start);
        let matched = self.observe(frame.features, &found.matches);
        let estimate = self.refine(&matched.observations, start)?;
        let (camera_from_world, points) =
            (estimate.camera_from_world, matched.inlier_points(&estimate.inliers));
        Some(FirstEstimate { camera_from_world, points, resting: None, source })
    }

    /// Looks for all points that keyframes around the first matches see, close to where the pose puts them.
    fn against_local_map(&self, frame: Frame, first: &FirstEstimate) -> Option<Located> {
        let local = local_map(self.map, first.points.iter().copied(), self.local_keyframes());
        let start = &first.camera_from_world;
        let search = self.projection(self.config.search.map_radius_px);
        let Found { matches, expected } =
            search.run(frame.features, self.map, local.points.into_iter(), start);
        let matched = self.observe(frame.features, &matches);
        let free = self.refine(&matched.observations, start)?;
        let resting = first.resting.filter(|pose| self.is_at_rest(&matched.observations, pose, &free));
        if !self.is_convincing(&free, first.source) {
            return None;
        }
        let (estimate, source) = match resting {
            Some(pose) => (self.unmoved(&matched.observations, pose), PoseSource::Standstill),
            None => (free, first.source),
        };
        let camera_from_world = estimate.camera_from_world;
        let posed = PosedFrame {
            stamp_ns: frame.stamp_ns,
            camera_from_world,
            frame: Arc::clone(frame.features),
            resting: resting.is_some(),
            matches: matched.inliers_by_feature(&estimate.inliers, frame.features.len()),
        };
        let misfits = matched.misfits(self.rig, &camera_from_world);
        Some(Located { posed, source, reference: local.reference, expected, misfits })
    }

    /// Whether enough matches fit, in number and in share.
    fn is_convincing(&self, estimate: &PoseEstimate, source: PoseSource) -> bool {
        let config = &self.config.recovery;
        let inliers_min = if source == PoseSource::Relocalisation {
            config.recovery_inliers_min
        } else {
            config.inliers_min
        };
        let inliers = estimate.inlier_count();
        inliers >= inliers_min as usize
            && inliers as f64 >= config.inlier_share_min * estimate.inliers.len() as f64
    }

    fn local_keyframes(&self) -> usize {
        self.config.map.local_keyframes as usize
    }

    /// Whether enough of the image is where a pose puts it, and not many times more is where the best pose puts it.
    fn is_at_rest(&self, points: &[PointObservation], pose: &Pose, free: &PoseEstimate) -> bool {
        let config = &self.config.standstill;
        let resting = still_share(self.rig, pose, points, config);
        let moving = still_share(self.rig, &free.camera_from_world, points, config);
        resting >= config.share_min && resting >= config.share_of_best_min * moving
    }

    fn unmoved(&self, points: &[PointObservation], pose: Pose) -> PoseEstimate {
        PoseEstimate { camera_from_world: pose, inliers: inliers(self.rig, &pose, points) }
    }

    fn refine(&self, observations: &[PointObservation], start: &Pose) -> Option<PoseEstimate> {
        let first_inliers_min = self.config.recovery.first_inliers_min as usize;
        if observations.len() < first_inliers_min {
            return None;
        }
        let estimate = refine_pose(self.rig, start, observations, &self.config.pose);
        (estimate.inlier_count() >= first_inliers_min).then_some(estimate)
    }

    fn observe(&self, features: &FrameFeatures, matches: &[Option<PointId>]) -> Matched {
        let mut matched = Matched { places: Vec::new(), observations: Vec::new() };
        for (feature, id) in matches.iter().enumerate() {
            let Some((id, point)) = id.and_then(|id| Some((id, self.map.point(id)?))) else { continue };
            let observation = features.observation(feature, self.scales, &self.config.pose);
            let (point_in_world, trust) = (point.position_in_world, point.trust());
            matched.places.push((feature, id));
            matched.observations.push(PointObservation { point_in_world, observation, trust });
        }
        matched
    }

    fn projection(&self, radius_px: f32) -> ProjectionSearch<'_> {
        ProjectionSearch { rig: self.rig, config: &self.config.search, scales: self.scales, radius_px }
    }
}

/// Where the local map search starts.
struct FirstEstimate {
    camera_from_world: Pose,
    /// Points seen, which choose the local map.
    points: Vec<PointId>,
    /// The last pose, where there is one to have stayed at.
    resting: Option<Pose>,
    source: PoseSource,
}

/// Features with their map points, and the same as observations, index by index.
struct Matched {
    places: Vec<(usize, PointId)>,
    observations: Vec<PointObservation>,
}

impl Matched {
    fn inliers<'a>(&'a self, inliers: &'a [bool]) -> impl Iterator<Item = (usize, PointId)> + 'a {
        self.places.iter().zip(inliers).filter(|(_, inlier)| **inlier).map(|(place, _)| *place)
    }

    fn inlier_points(&self, inliers: &[bool]) -> Vec<PointId> {
        self.inliers(inliers).map(|(_, id)| id).collect()
    }

    fn inliers_by_feature(&self, inliers: &[bool], features: usize) -> Vec<Option<PointId>> {
        let mut by_feature = vec![None; features];
        for (feature, id) in self.inliers(inliers) {
            by_feature[feature] = Some(id);
        }
        by_feature
    }

    /// How badly each point fits a pose.
    fn misfits(&self, rig: &StereoRig, camera_from_world: &Pose) -> Vec<(PointId, f64)> {
        let misfit = |point: &PointObservation| {
            point.observation.misfit(rig, &(camera_from_world * point.point_in_world))
        };
        self.places.iter().zip(&self.observations).map(|(&(_, id), point)| (id, misfit(point))).collect()
    }
}
