//! Features followed from frame to frame, those on moving tissue included.
//!
//! Where both frames match one map point under their rigid poses, the feature is followed rigidly. The other features of the
//! earlier frame are looked for by descriptor around where the camera's motion alone would put them ([`search`]); such a
//! match is kept only where its neighbours have moved alike ([`consensus`]): tissue deforms smoothly, mismatches do not.
//! Where a neighbourhood as a whole has moved beyond the camera's motion, its features count as deforming even if each alone might be
//! noise. The dense model bends by these matches.

pub mod consensus;
pub mod search;

use std::collections::BTreeMap;
use std::sync::Arc;

use geometry::{Pose, StereoRig};
use nalgebra::Vector3;

use crate::config::{FollowingConfig, PoseConfig};
use crate::frame::FrameFeatures;
use crate::local_mapping::PosedFrame;
use crate::map::PointId;
use crate::report::{FeatureMotion, TrackId};
use crate::solve::reprojection::{Observation, project};

/// What all steps read.
#[derive(Clone, Copy, Debug)]
pub struct FollowingContext<'a> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// Full-size pixels per pixel of each level.
    pub scales: &'a [f32],
    /// Uncertainty of features.
    pub pose: &'a PoseConfig,
    /// Limits.
    pub following: &'a FollowingConfig,
}

/// A feature of the earlier frame found again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Index in the earlier frame.
    pub previous: usize,
    /// Index in this frame.
    pub current: usize,
    /// Left column, row and right column, observed minus where the camera's motion alone puts them, px. The third is 0
    /// where this frame has no stereo match.
    pub residual_px: Vector3<f32>,
    /// Whether that is within the noise of a feature.
    pub rigid: bool,
}

/// A feature of this frame as part of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// The same number as in the frame before, if it was found there.
    pub track: TrackId,
    /// From where; `None` for a feature that starts its track.
    pub motion: Option<FeatureMotion>,
}

/// Follows the features of one camera.
#[derive(Debug, Default)]
pub struct Follower {
    last: Option<Seen>,
    tracks_started: u64,
}

/// The last tracked frame.
#[derive(Debug)]
struct Seen {
    posed: PosedFrame,
    tracks: Vec<TrackId>,
}

impl Follower {
    /// Joins a tracked frame to the one tracked before it; one entry for each of its features.
    pub fn follow(&mut self, posed: &PosedFrame, context: &FollowingContext) -> Vec<Followed> {
        let mut followed: Vec<Option<Followed>> = vec![None; posed.frame.len()];
        if let Some(last) = &self.last {
            for (step, weight) in steps(&last.posed, posed, context) {
                let motion = Some(motion(&last.posed.frame, &posed.frame, &step, weight));
                followed[step.current] = Some(Followed { track: last.tracks[step.previous], motion });
            }
        }
        let started = &mut self.tracks_started;
        let followed: Vec<Followed> = followed
            .into_iter()
            .map(|entry| {
                entry.unwrap_or_else(|| {
                    *started += 1;
                    Followed { track: TrackId(*started), motion: None }
                })
            })
            .collect();
        let tracks = followed.iter().map(|feature| feature.track).collect();
        self.last = Some(Seen { posed: posed.clone(), tracks });
        followed
    }
}

/// The trustworthy steps and their weights, each feature of either frame at most once.
fn steps(last: &PosedFrame, now: &PosedFrame, context: &FollowingContext) -> Vec<(Step, f32)> {
    let rigid_motion = RigidMotion::between(last, now, context);
    let mut steps = through_map(last, now, &rigid_motion);
    let by_map = steps.len();
    steps.extend(search::by_descriptor(last, now, &rigid_motion, &steps));
    let opinions = consensus::consensus(&now.frame, &steps, context.following);
    let judged = steps.into_iter().zip(opinions).enumerate();
    judged
        .filter_map(|(index, (step, opinion))| {
            let share = if index < by_map { Some(1.0) } else { opinion.map(|opinion| opinion.share) };
            let still = opinion.is_none_or(|opinion| opinion.mean_px.norm() <= context.following.still_px);
            let scale = context.scales[usize::from(now.frame.features.keypoints[step.current].level)];
            Some((Step { rigid: step.rigid && still, ..step }, share? / (scale * scale)))
        })
        .collect()
}

/// Pairs of features that match one map point.
fn through_map(last: &PosedFrame, now: &PosedFrame, motion: &RigidMotion) -> Vec<Step> {
    let earlier: BTreeMap<PointId, usize> =
        last.matches.iter().enumerate().filter_map(|(feature, id)| Some(((*id)?, feature))).collect();
    let joined = now.matches.iter().enumerate().filter_map(|(current, id)| {
        let previous = *earlier.get(&(*id)?)?;
        let residual_px = motion.step(previous, current).map_or_else(Vector3::zeros, |step| step.residual_px);
        Some(Step { previous, current, residual_px, rigid: true })
    });
    joined.collect()
}

fn motion(last: &FrameFeatures, now: &FrameFeatures, step: &Step, weight: f32) -> FeatureMotion {
    let disparity_px = |frame: &FrameFeatures, feature: usize| {
        Some(frame.features.keypoints[feature].pixel.x - frame.stereo[feature]?.right_x_px)
    };
    FeatureMotion {
        previous_pixel: last.features.keypoints[step.previous].pixel,
        previous_disparity_px: disparity_px(last, step.previous),
        disparity_px: disparity_px(now, step.current),
        rigid: step.rigid,
        weight,
    }
}

/// Where features of the earlier frame would be if only the camera had moved.
pub struct RigidMotion<'a> {
    last: &'a PosedFrame,
    now: &'a PosedFrame,
    now_from_last: Pose,
    context: &'a FollowingContext<'a>,
}

impl<'a> RigidMotion<'a> {
    fn between(last: &'a PosedFrame, now: &'a PosedFrame, context: &'a FollowingContext<'a>) -> Self {
        let now_from_last = now.camera_from_world * last.camera_from_world.inverse();
        Self { last, now, now_from_last, context }
    }

    /// Left column, row and right column, px; `None` where the earlier feature has no depth or is not in front.
    pub fn predict_px(&self, previous: usize) -> Option<Vector3<f64>> {
        let frame = &self.last.frame;
        let depth_m = frame.stereo[previous]?.depth_m;
        let point = self.now_from_last * self.context.rig.left.back_project(&frame.pixel(previous), depth_m);
        (point.z > 0.0).then(|| project(self.context.rig, &point))
    }

    /// A pair as a step; `None` where nothing can be predicted.
    pub fn step(&self, previous: usize, current: usize) -> Option<Step> {
        let predicted = self.predict_px(previous)?;
        let observation = self.observation(&self.now.frame, current);
        let right = observation.right_x_px.map_or(0.0, |observed| observed - predicted.z);
        let pixel = observation.pixel;
        let residual = Vector3::new(pixel.x - predicted.x, pixel.y - predicted.y, right);
        let earlier_sigma_px = self.observation(&self.last.frame, previous).sigma_px;
        let variance = observation.sigma_px.powi(2) + earlier_sigma_px.powi(2);
        let rigid = residual.norm_squared() <= observation.chi2_limit() * variance;
        Some(Step { previous, current, residual_px: residual.cast(), rigid })
    }

    fn observation(&self, frame: &Arc<FrameFeatures>, feature: usize) -> Observation {
        frame.observation(feature, self.context.scales, self.context.pose)
    }

    fn limits(&self) -> &FollowingConfig {
        self.context.following
    }
}
