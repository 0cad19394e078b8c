//! The part of the map that a frame is likely to see: keyframes that share points with it, and their points.

use std::collections::{BTreeMap, BTreeSet};

use super::{KeyframeId, Map, PointId};

/// Keyframes by shared points, most first, and all points that they see.
#[derive(Clone, Debug, Default)]
pub struct LocalMap {
    /// The keyframe that shares most points: the reference.
    pub reference: Option<KeyframeId>,
    /// Points in order of their ids.
    pub points: BTreeSet<PointId>,
}

/// The local map around some points: the keyframes that see most of them, filled up with the ones that share most points with
/// the reference, `keyframes_max` in all.
pub fn local_map(map: &Map, points: impl Iterator<Item = PointId>, keyframes_max: usize) -> LocalMap {
    let mut chosen = most_sharing(map, points, keyframes_max / 2 + 1);
    let Some(&reference) = chosen.first() else { return LocalMap::default() };
    if let Some(keyframe) = map.keyframe(reference) {
        let neighbours = most_sharing(map, keyframe.points().iter().flatten().copied(), keyframes_max);
        for neighbour in neighbours {
            if chosen.len() < keyframes_max && !chosen.contains(&neighbour) {
                chosen.push(neighbour);
            }
        }
    }
    let keyframes = chosen.iter().filter_map(|&id| map.keyframe(id));
    let points = keyframes.flat_map(|keyframe| keyframe.points().iter().flatten().copied()).collect();
    LocalMap { reference: Some(reference), points }
}

/// Keyframes that share points with one, with how many; most first, of equals the newer.
pub fn covisible(map: &Map, id: KeyframeId) -> Vec<(KeyframeId, u32)> {
    let Some(keyframe) = map.keyframe(id) else { return Vec::new() };
    let mut shared = shared_counts(map, keyframe.points().iter().flatten().copied());
    shared.retain(|(_, other)| *other != id);
    shared.into_iter().map(|(count, other)| (other, count)).collect()
}

/// Keyframes by the number of these points that they see; of equals the newer first.
fn most_sharing(map: &Map, points: impl Iterator<Item = PointId>, keyframes_max: usize) -> Vec<KeyframeId> {
    shared_counts(map, points).into_iter().take(keyframes_max).map(|(_, id)| id).collect()
}

fn shared_counts(map: &Map, points: impl Iterator<Item = PointId>) -> Vec<(u32, KeyframeId)> {
    let mut shared: BTreeMap<KeyframeId, u32> = BTreeMap::new();
    for seen in points.filter_map(|id| map.point(id)).flat_map(super::MapPoint::seen) {
        *shared.entry(seen.keyframe).or_default() += 1;
    }
    let mut order: Vec<(u32, KeyframeId)> = shared.into_iter().map(|(id, count)| (count, id)).collect();
    order.sort_unstable_by(|a, b| b.cmp(a));
    order
}
