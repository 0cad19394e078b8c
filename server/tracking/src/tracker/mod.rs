//! The tracker: one frame in, one report out. All changes of state happen in [`Tracker::track`].

mod keyframe_rule;
mod mapping;
mod motion_model;
mod odometry;
pub(crate) mod pose_search;
mod recovery;

use std::sync::Arc;

use geometry::{Pose, StereoRig};
use tracing::trace_span;

use crate::TrackingError;
use crate::config::{TrackingConfig, TrackingMode};
use crate::feature::Extractor;
use crate::feature::extract::has_room_for_features;
use crate::following::{Followed, Follower, FollowingContext};
use crate::frame::{FrameFeatures, StereoFrame};
use crate::local_mapping::{self, Mapper, MappingContext, MappingPace, PosedFrame};
use crate::map::{KeyframeId, Map};
use crate::relocalization::PlaceIndex;
use crate::report::{
    KeyframeReason, MapCorrection, Outcome, PoseSource, StereoDrift, TrackedFeature, TrackingReport,
    TrackingStatistics,
};
use crate::solve::reprojection::PointObservation;
use crate::solve::stereo_drift::{believed_drift_px, disparity_excess_px, gain};
use keyframe_rule::TrackedFrame;
use motion_model::Velocity;
use pose_search::{Frame, Located, PoseSearch};

/// Follows one stereo camera; owns its map.
#[derive(Debug)]
pub struct Tracker {
    config: TrackingConfig,
    rig: StereoRig,
    extractor: Extractor,
    scales: Vec<f32>,
    map: Map,
    state: State,
    mapper: Mapper,
    mapping: MappingContext,
    places: PlaceIndex,
    /// Of the frame under way.
    correction: Option<MapCorrection>,
    /// The newest keyframe that mapping has not begun with.
    unmapped: Option<KeyframeId>,
    keyframes_passed_over: u64,
    frame_number: u64,
    last_stamp_ns: Option<u64>,
    drift: StereoDrift,
    /// Of the disparity, whether it is large enough to be believed or not.
    measured_drift_px: f64,
    follower: Follower,
}

#[derive(Debug)]
enum State {
    NotInitialized,
    Tracking(Track),
    /// With the number of usable frames since, and where the camera was last seen.
    Lost {
        since_ns: u64,
        attempts: u64,
        last_seen: Pose,
    },
}

/// What is carried from one tracked frame to the next.
#[derive(Debug)]
struct Track {
    last: PosedFrame,
    velocity: Option<Velocity>,
    /// The keyframe that shares most points with the last frame.
    reference: KeyframeId,
    frames_since_keyframe: u32,
    /// Odometry: since when no frame could be joined to the one before.
    lost_since_ns: Option<u64>,
}

impl Tracker {
    /// A tracker without a map, for replays: the same frames give the same poses.
    ///
    /// # Errors
    /// [`TrackingError::Config`] for values out of range, [`TrackingError::Rig`] and [`TrackingError::RigSize`] for rigs
    /// that nothing can be measured with, [`TrackingError::MappingThread`] where no thread is to be had.
    pub fn new(config: &TrackingConfig, rig: &StereoRig) -> Result<Self, TrackingError> {
        Self::with_pace(config, rig, MappingPace::Lockstep)
    }

    /// A tracker without a map that takes the results of mapping at a pace: for live video, which must not wait for them.
    ///
    /// # Errors
    /// As [`Tracker::new`].
    pub fn with_pace(
        config: &TrackingConfig,
        rig: &StereoRig,
        pace: MappingPace,
    ) -> Result<Self, TrackingError> {
        config.validate()?;
        check_rig(rig, config)?;
        let extractor = Extractor::new(&config.features);
        let scales = extractor.scales();
        let (map, state) = (Map::default(), State::NotInitialized);
        let context = MappingContext { rig: *rig, scales: scales.clone(), config: config.clone() };
        let mapper = Mapper::start(context.clone(), pace)?;
        Ok(Self {
            config: config.clone(),
            rig: *rig,
            extractor,
            scales,
            map,
            state,
            mapper,
            mapping: context,
            places: PlaceIndex::new(),
            correction: None,
            unmapped: None,
            keyframes_passed_over: 0,
            frame_number: 0,
            last_stamp_ns: None,
            drift: StereoDrift::default(),
            measured_drift_px: 0.0,
            follower: Follower::default(),
        })
    }

    /// The sparse map.
    pub fn map(&self) -> &Map {
        &self.map
    }

    /// Tracks a frame, newer than all before.
    ///
    /// # Errors
    /// [`TrackingError::ImageSize`] and [`TrackingError::Stamp`]; the tracker is as before then. [`TrackingError::MappingThread`]
    /// where mapping has died.
    pub fn track(&mut self, frame: &StereoFrame) -> Result<TrackingReport, TrackingError> {
        frame.check_size(&self.rig)?;
        let stamp_ns = frame.stamp_ns;
        if let Some(last_ns) = self.last_stamp_ns.filter(|&last_ns| stamp_ns <= last_ns) {
            return Err(TrackingError::Stamp { stamp_ns, last_ns });
        }
        if self.config.mode == TrackingMode::None {
            self.last_stamp_ns = Some(stamp_ns);
            return Ok(self.unmoving());
        }
        self.frame_number += 1;
        let elapsed_ns = self.last_stamp_ns.replace(stamp_ns).map_or(0, |last_ns| stamp_ns - last_ns);
        let features = trace_span!("find features")
            .in_scope(|| FrameFeatures::extract(frame, &self.rig, &self.extractor, &self.config));
        let features = Arc::new(features.without_drift(&self.rig, self.drift.disparity_px));
        let frame = Frame { stamp_ns, features: &features };
        trace_span!("take mapping").in_scope(|| self.take_mapping())?;

        let posing = trace_span!("find pose").entered();
        let before = std::mem::replace(&mut self.state, State::NotInitialized);
        let starting = matches!(before, State::NotInitialized);
        let located = match &before {
            State::NotInitialized => self.first_frame(frame),
            State::Tracking(track) => self.follow(frame, track),
            State::Lost { attempts, .. } => {
                self.relocalise(frame, *attempts).or_else(|| self.begin_anew(frame, *attempts))
            }
        };
        let elapsed_s = elapsed_ns as f64 * 1e-9;
        self.follow_rows(&features, if starting { f64::INFINITY } else { elapsed_s });
        let located = located.map(|located| self.follow_disparity(located, elapsed_s));
        let (state, verdict) = match (located, before) {
            (Some(located), State::Lost { .. }) if located.source == PoseSource::FirstFrame => {
                self.accept(located, Outcome::Tracked, None)
            }
            (Some(located), State::Lost { last_seen, .. }) => {
                self.note_relocalisation(&located, &last_seen);
                self.accept(located, Outcome::Recovered, None)
            }
            (Some(located), State::Tracking(track)) => self.accept(located, Outcome::Tracked, Some(&track)),
            (Some(located), State::NotInitialized) => self.accept(located, Outcome::Tracked, None),
            (None, State::NotInitialized) => (State::NotInitialized, Outcome::NotInitialized.into()),
            (None, State::Tracking(track)) if self.is_odometry() => self.go_on_from(frame, track),
            (None, State::Tracking(track)) => lost(stamp_ns, 1, track.last.camera_from_world),
            (None, State::Lost { since_ns, attempts, last_seen }) => {
                let usable = features.stereo_count() >= self.config.recovery.initial_points_min as usize;
                lost(since_ns, attempts + u64::from(usable), last_seen)
            }
        };
        self.state = state;
        drop(posing);
        trace_span!("give mapping").in_scope(|| self.give_mapping())?;
        let followed = match verdict.world_from_camera {
            Some(_) => trace_span!("follow features").in_scope(|| self.follow_features()),
            None => Vec::new(),
        };
        Ok(self.report(&features, &verdict, &followed))
    }

    /// Joins the features to those of the frame before; none where there is no pose.
    fn follow_features(&mut self) -> Vec<Followed> {
        let State::Tracking(Track { last, .. }) = &self.state else { return Vec::new() };
        let (pose, following) = (&self.config.pose, &self.config.following);
        let context = FollowingContext { rig: &self.rig, scales: &self.scales, pose, following };
        self.follower.follow(last, &context)
    }

    /// The first frame with enough stereo points is the world.
    fn first_frame(&self, frame: Frame) -> Option<Located> {
        let enough = frame.features.stereo_count() >= self.config.recovery.initial_points_min as usize;
        enough.then(|| Located {
            posed: PosedFrame {
                stamp_ns: frame.stamp_ns,
                camera_from_world: Pose::identity(),
                frame: Arc::clone(frame.features),
                resting: false,
                matches: vec![None; frame.features.len()],
            },
            source: PoseSource::FirstFrame,
            reference: None,
            expected: Vec::new(),
            misfits: Vec::new(),
        })
    }

    fn follow(&self, frame: Frame, track: &Track) -> Option<Located> {
        let predicted = motion_model::predict(&track.last, track.velocity.as_ref(), frame.stamp_ns);
        let search = self.pose_search();
        search
            .by_motion(frame, &track.last, &predicted)
            .or_else(|| search.by_view(frame, (&track.last).into(), PoseSource::LastFrame))
            .or_else(|| {
                let reference = self.map.keyframe(track.reference)?;
                search.by_view(frame, reference.into(), PoseSource::ReferenceKeyframe)
            })
            .or_else(|| self.relocalise(frame, 0))
    }

    /// Rows need no pose.
    fn follow_rows(&mut self, features: &FrameFeatures, elapsed_s: f64) {
        let enough = features.stereo_count() >= self.config.recovery.initial_points_min as usize;
        let Some(row_px) = features.median_row_offset_px().filter(|_| enough) else { return };
        let config = &self.config.stereo;
        let gain = gain(elapsed_s, config.drift_time_s);
        let row_px = self.drift.row_px + gain * (row_px - self.drift.row_px);
        self.drift.row_px = row_px.clamp(-config.drift_max_px, config.drift_max_px);
    }

    /// Takes what all disparities have too much as drift of the rig, and off the frame before the map learns from it.
    fn follow_disparity(&mut self, mut located: Located, elapsed_s: f64) -> Located {
        let posed = &mut located.posed;
        let observed = posed.matches.iter().enumerate().filter_map(|(feature, id)| {
            let point = self.map.point((*id)?)?;
            let observation = posed.frame.observation(feature, &self.scales, &self.config.pose);
            Some(PointObservation { point_in_world: point.position_in_world, observation, trust: 1.0 })
        });
        let observed: Vec<PointObservation> = observed.collect();
        let config = &self.config.stereo;
        let gain = gain(elapsed_s, config.drift_time_s);
        let limited = |drift_px: f64| drift_px.clamp(-config.drift_max_px, config.drift_max_px);
        if let Some(excess_px) = disparity_excess_px(&self.rig, &posed.camera_from_world, &observed) {
            let measured_px = self.drift.disparity_px + excess_px;
            self.measured_drift_px =
                limited(self.measured_drift_px + gain * (measured_px - self.measured_drift_px));
            let disparity_px = believed_drift_px(self.measured_drift_px, config.drift_min_px);
            let step_px = disparity_px - self.drift.disparity_px;
            posed.frame = Arc::new(posed.frame.as_ref().clone().without_drift(&self.rig, step_px));
            self.drift.disparity_px = disparity_px;
        }
        located
    }

    /// A pose was found: the map learns from the frame, and the next one starts from it.
    fn accept(&mut self, located: Located, outcome: Outcome, track: Option<&Track>) -> (State, Verdict) {
        self.count_sightings(&located);
        let keyframe = self.keyframe_reason(&located, track);
        let inliers = located.inliers();
        let matched = located.posed.matches.iter().map(Option::is_some).collect();
        let Located { mut posed, source, reference, expected, misfits } = located;
        let reference = match (keyframe, reference) {
            (None, Some(reference)) => reference,
            _ => self.make_keyframe(&mut posed),
        };
        let verdict = Verdict {
            outcome,
            world_from_camera: Some(posed.camera_from_world.inverse()),
            source: Some(source),
            matched,
            searched_points: expected.len(),
            matches: misfits.len(),
            inliers,
            keyframe,
        };
        let state = Track {
            velocity: track.map(|track| Velocity::between(&track.last, &posed)),
            last: posed,
            reference,
            frames_since_keyframe: match (keyframe, track) {
                (None, Some(track)) => track.frames_since_keyframe.saturating_add(1),
                _ => 1,
            },
            lost_since_ns: None,
        };
        (State::Tracking(state), verdict)
    }

    fn count_sightings(&mut self, located: &Located) {
        for &id in &located.expected {
            if let Some(point) = self.map.point_mut(id) {
                point.expected = point.expected.saturating_add(1);
            }
        }
        for &(id, misfit) in &located.misfits {
            if let Some(point) = self.map.point_mut(id) {
                point.observe_misfit(misfit);
            }
        }
        for &id in located.posed.matches.iter().flatten() {
            if let Some(point) = self.map.point_mut(id) {
                point.found = point.found.saturating_add(1);
            }
        }
    }

    fn keyframe_reason(&self, located: &Located, track: Option<&Track>) -> Option<KeyframeReason> {
        let Some(reference) = located.reference.and_then(|id| self.map.keyframe(id)) else {
            return Some(KeyframeReason::First);
        };
        if self.is_odometry() {
            return Some(KeyframeReason::Odometry);
        }
        let frame = TrackedFrame {
            camera_from_world: located.posed.camera_from_world,
            inliers: located.inliers(),
            median_depth_m: located.posed.frame.median_depth_m(),
            frames_since_keyframe: track.map_or(u32::MAX, |track| track.frames_since_keyframe),
        };
        keyframe_rule::reason(&frame, reference, &self.config.map)
    }

    /// Inserts a keyframe; the frame then tracks the points that it made.
    fn make_keyframe(&mut self, posed: &mut PosedFrame) -> KeyframeId {
        if self.is_odometry() {
            return self.restart_map(posed);
        }
        let id = local_mapping::insert_keyframe(&mut self.map, posed, &self.rig, &self.config.map);
        let configs = (&self.config.pose, &self.config.map);
        local_mapping::refine_points(&mut self.map, id, &self.rig, &self.scales, configs);
        local_mapping::cull(&mut self.map, id, &self.config.map);
        self.queue_mapping(id);
        if let Some(keyframe) = self.map.keyframe(id) {
            posed.matches = keyframe.points().to_vec();
        }
        id
    }

    fn pose_search(&self) -> PoseSearch<'_> {
        PoseSearch { config: &self.config, rig: &self.rig, scales: &self.scales, map: &self.map }
    }

    fn report(
        &mut self,
        features: &FrameFeatures,
        verdict: &Verdict,
        followed: &[Followed],
    ) -> TrackingReport {
        let feature = |(index, keypoint): (usize, &crate::feature::Keypoint)| TrackedFeature {
            pixel: keypoint.pixel,
            depth_m: features.stereo[index].map(|stereo| stereo.depth_m),
            matched: verdict.matched.get(index).copied().unwrap_or(false),
            track: followed.get(index).map(|feature| feature.track),
            motion: followed.get(index).and_then(|feature| feature.motion),
        };
        TrackingReport {
            outcome: verdict.outcome,
            world_from_camera: verdict.world_from_camera,
            source: verdict.source,
            features: features.features.keypoints.iter().enumerate().map(feature).collect(),
            statistics: TrackingStatistics {
                left_features: features.len(),
                right_features: features.right_count,
                stereo_points: features.stereo_count(),
                searched_points: verdict.searched_points,
                matches: verdict.matches,
                inliers: verdict.inliers,
                keyframes: self.map.keyframe_count(),
                map_points: self.map.point_count(),
                keyframes_passed_over: self.keyframes_passed_over,
            },
            keyframe: verdict.keyframe,
            drift: self.drift,
            correction: self.correction.take(),
        }
    }
}

/// The part of the report that the search decides.
struct Verdict {
    outcome: Outcome,
    world_from_camera: Option<Pose>,
    source: Option<PoseSource>,
    /// By feature; empty where there is no pose.
    matched: Vec<bool>,
    searched_points: usize,
    matches: usize,
    inliers: usize,
    keyframe: Option<KeyframeReason>,
}

impl From<Outcome> for Verdict {
    /// No pose.
    fn from(outcome: Outcome) -> Self {
        Self {
            outcome,
            world_from_camera: None,
            source: None,
            matched: Vec::new(),
            searched_points: 0,
            matches: 0,
            inliers: 0,
            keyframe: None,
        }
    }
}

fn lost(since_ns: u64, attempts: u64, last_seen: Pose) -> (State, Verdict) {
    (State::Lost { since_ns, attempts, last_seen }, Outcome::Lost { since_ns }.into())
}

fn check_rig(rig: &StereoRig, config: &TrackingConfig) -> Result<(), TrackingError> {
    let camera = &rig.left;
    for (field, value) in
        [("left.fx_px", camera.fx_px), ("left.fy_px", camera.fy_px), ("baseline_m", rig.baseline_m)]
    {
        if !(value.is_finite() && value > 0.0) {
            return Err(TrackingError::Rig { field, value });
        }
    }
    let (width, height) = (camera.width_px, camera.height_px);
    if !has_room_for_features((width, height), &config.features) {
        return Err(TrackingError::RigSize { width, height, levels: config.features.levels });
    }
    Ok(())
}
