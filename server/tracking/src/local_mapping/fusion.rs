//! Points that a new keyframe made are looked for in its neighbours: some were there already, under another name.

use std::collections::BTreeMap;

use geometry::StereoRig;

use super::edit::Edit;
use crate::config::TrackingConfig;
use crate::map::{KeyframeId, Map, PointId, Seen};
use crate::matching::projection::ProjectionSearch;

/// Merges points of two keyframes that are one, and adds sightings that tracking missed: what `neighbour` sees of `points`.
pub fn fuse(
    map: &Map,
    points: &[PointId],
    neighbour: KeyframeId,
    (rig, scales): (&StereoRig, &[f32]),
    config: &TrackingConfig,
) -> Vec<Edit> {
    let Some(keyframe) = map.keyframe(neighbour) else { return Vec::new() };
    let pose = &keyframe.camera_from_world;
    let radius_px = config.mapping.fusion_radius_px;
    let search = ProjectionSearch { rig, config: &config.search, scales, radius_px };
    let unseen = points.iter().copied().filter(|id| {
        map.point(*id).is_some_and(|point| point.seen().iter().all(|seen| seen.keyframe != neighbour))
    });
    let found = search.run(&keyframe.frame, map, unseen, pose);
    let matched = found.matches.iter().enumerate().filter_map(|(feature, id)| Some((feature, (*id)?)));
    matched
        .filter_map(|(feature, id)| {
            let point = map.point(id)?;
            let observation = keyframe.frame.observation(feature, scales, &config.pose);
            if !observation.fits(rig, &(pose * point.position_in_world)) {
                return None;
            }
            match keyframe.points()[feature] {
                None => Some(Edit::Link { point: id, seen: Seen { keyframe: neighbour, feature } }),
                Some(other) => {
                    let known = map.point(other)?;
                    observation.fits(rig, &(pose * known.position_in_world)).then(|| {
                        let (kept, duplicate) =
                            better_known((other, known.seen().len()), (id, point.seen().len()));
                        Edit::Merge { kept, duplicate }
                    })
                }
            }
        })
        .collect()
}

/// The one with more sightings, of equals the older, then the other.
fn better_known(a: (PointId, usize), b: (PointId, usize)) -> (PointId, PointId) {
    let a_is_better = (a.1, std::cmp::Reverse(a.0)) > (b.1, std::cmp::Reverse(b.0));
    if a_is_better { (a.0, b.0) } else { (b.0, a.0) }
}

/// The points that a keyframe made, in order.
pub fn points_made_by(map: &Map, keyframe: KeyframeId) -> Vec<PointId> {
    map.points().filter(|(_, point)| point.created_in == keyframe).map(|(id, _)| id).collect()
}

/// Merges in chains end at one point: each edit speaks of what the edits before it left.
pub fn resolve_chains(edits: Vec<Edit>) -> Vec<Edit> {
    let mut now: BTreeMap<PointId, PointId> = BTreeMap::new();
    let end = |now: &BTreeMap<PointId, PointId>, mut id: PointId| {
        while let Some(next) = now.get(&id) {
            id = *next;
        }
        id
    };
    let mut resolved = Vec::with_capacity(edits.len());
    for edit in edits {
        match edit {
            Edit::Merge { kept, duplicate } => {
                let (kept, duplicate) = (end(&now, kept), end(&now, duplicate));
                if kept != duplicate {
                    now.insert(duplicate, kept);
                    resolved.push(Edit::Merge { kept, duplicate });
                }
            }
            Edit::Link { point, seen } => resolved.push(Edit::Link { point: end(&now, point), seen }),
            other => resolved.push(other),
        }
    }
    resolved
}
