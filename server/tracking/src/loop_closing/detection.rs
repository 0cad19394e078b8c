//! Suspicion and proof of a loop.

use std::collections::BTreeSet;
use std::sync::Arc;

use geometry::Pose;

use crate::config::TrackingConfig;
use crate::local_mapping::MappingContext;
use crate::map::{Keyframe, KeyframeId, Map, PointId, covisible, excerpt};
use crate::relocalization::{PlaceIndex, candidates};
use crate::report::PoseSource;
use crate::tracker::pose_search::{Frame, PoseSearch};

/// Neighbours of the old keyframe that are looked at together with it.
const OLD_NEIGHBOURS: usize = 8;
/// Neighbours whose own neighbours count as connected.
const CONNECTED_THROUGH: usize = 10;

/// An old keyframe that a new one looks like, and a copy of the map around it.
#[derive(Clone, Debug)]
pub struct Suspicion {
    keyframe: KeyframeId,
    part: Map,
}

/// A loop that is proven.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopClosure {
    /// The new keyframe.
    pub keyframe: KeyframeId,
    /// The old one.
    pub old: KeyframeId,
    /// The new one's pose by the old part of the map.
    pub camera_from_world: Pose,
    /// Features of the new one and the old points that they show.
    pub matches: Vec<(usize, PointId)>,
}

/// The old keyframe that looks most like a new one without being connected to it, if it looks enough like it.
pub fn suspect(
    map: &Map,
    places: &PlaceIndex,
    newest: KeyframeId,
    config: &TrackingConfig,
) -> Option<Suspicion> {
    let keyframe = map.keyframe(newest)?;
    let connected = connected(map, newest);
    let old_enough = |id: KeyframeId| id.age(newest) >= u64::from(config.loops.keyframes_between_min);
    let eligible = |id: KeyframeId| old_enough(id) && !connected.contains(&id);
    let bits = config.recognition.distance_max_bits;
    let descriptors = keyframe.mapped_descriptors();
    let best = candidates(places, map, &descriptors, bits, eligible).into_iter().next()?;
    if best.group_share < config.loops.share_min {
        return None;
    }
    let neighbours = covisible(map, best.keyframe).into_iter().map(|(id, _)| id).take(OLD_NEIGHBOURS);
    let old: Vec<KeyframeId> = std::iter::once(best.keyframe).chain(neighbours).collect();
    let mut part = excerpt(map, &old, old.len());
    part.drop_dangling();
    Some(Suspicion { keyframe: best.keyframe, part })
}

/// A keyframe, those that share points with it, and those that share points with them.
fn connected(map: &Map, id: KeyframeId) -> BTreeSet<KeyframeId> {
    let direct: Vec<KeyframeId> = covisible(map, id).into_iter().map(|(other, _)| other).collect();
    let through = direct.iter().take(CONNECTED_THROUGH).flat_map(|&other| covisible(map, other));
    let mut connected: BTreeSet<KeyframeId> = through.map(|(other, _)| other).collect();
    connected.extend(direct);
    connected.insert(id);
    connected
}

impl Suspicion {
    /// Looks for the old points in the new keyframe; `None` where too few agree on a pose.
    pub fn prove(
        &self,
        newest: KeyframeId,
        keyframe: &Keyframe,
        context: &MappingContext,
    ) -> Option<LoopClosure> {
        let MappingContext { rig, scales, config } = context;
        let search = PoseSearch { config, rig, scales, map: &self.part };
        let frame = Frame { stamp_ns: keyframe.stamp_ns, features: &Arc::clone(&keyframe.frame) };
        let old = self.part.keyframe(self.keyframe)?;
        let located = search.by_view(frame, old.into(), PoseSource::Relocalisation)?;
        if located.inliers() < config.loops.inliers_min as usize {
            return None;
        }
        let matches = located.posed.matches.iter().enumerate();
        Some(LoopClosure {
            keyframe: newest,
            old: self.keyframe,
            camera_from_world: located.posed.camera_from_world,
            matches: matches.filter_map(|(feature, id)| Some((feature, (*id)?))).collect(),
        })
    }
}
