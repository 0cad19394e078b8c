//! Keeps the map small and trustworthy.

use crate::config::{MapConfig, MappingConfig};
use crate::map::{KeyframeId, Map, PointId, covisible};

/// A point must have been expected this often before its share of being found says anything.
const EXPECTED_MIN: u32 = 8;
/// The latest keyframes are never removed.
const RECENT_KEYFRAMES: usize = 5;
/// A keyframe's point is redundant if this many other keyframes see it.
const REDUNDANT_SIGHTINGS: usize = 3;

/// Removes those of a keyframe's neighbours that add nothing: nearly all of their points are seen by several others as finely.
pub fn cull_redundant(map: &mut Map, newest: KeyframeId, config: &MappingConfig) {
    let recent: Vec<KeyframeId> = map.keyframes().rev().take(RECENT_KEYFRAMES).map(|(id, _)| id).collect();
    let oldest = map.keyframes().next().map(|(id, _)| id);
    for (id, _) in covisible(map, newest) {
        if !recent.contains(&id) && Some(id) != oldest && redundant_share(map, id) >= config.redundant_share {
            map.remove_keyframe(id);
        }
    }
}

/// Share of a keyframe's points that [`REDUNDANT_SIGHTINGS`] others see on the same level, one above, or finer ones.
fn redundant_share(map: &Map, id: KeyframeId) -> f64 {
    let Some(keyframe) = map.keyframe(id) else { return 0.0 };
    let (mut points, mut redundant) = (0_u32, 0_u32);
    for (feature, point) in keyframe.points().iter().enumerate() {
        let Some(point) = point.and_then(|point| map.point(point)) else { continue };
        let level = keyframe.frame.features.keypoints[feature].level;
        let as_fine = point.seen().iter().filter(|seen| {
            let other = map.keyframe(seen.keyframe).filter(|_| seen.keyframe != id);
            other.is_some_and(|other| other.frame.features.keypoints[seen.feature].level <= level + 1)
        });
        points += 1;
        redundant += u32::from(as_fine.count() >= REDUNDANT_SIGHTINGS);
    }
    if points == 0 { 1.0 } else { f64::from(redundant) / f64::from(points) }
}

/// Removes doubtful points, then, beyond the configured numbers, redundant keyframes and the least seen old points.
pub fn cull(map: &mut Map, newest: KeyframeId, config: &MapConfig) {
    let doubtful: Vec<PointId> = map
        .points()
        .filter(|(_, point)| {
            let rarely_found = point.expected >= EXPECTED_MIN && point.found_share() < config.found_share_min;
            let unconfirmed = point.created_in.age(newest) >= u64::from(config.probation_keyframes)
                && point.seen().len() < 2
                && point.found < 2;
            rarely_found || unconfirmed
        })
        .map(|(id, _)| id)
        .collect();
    for id in doubtful {
        map.remove_point(id);
    }
    while map.keyframe_count() > config.keyframes_max as usize {
        let Some(id) = most_redundant(map) else { break };
        map.remove_keyframe(id);
    }
    remove_excess_points(map, config.points_max as usize);
}

/// The keyframe with the largest share of points that others see as well; of equals the oldest.
fn most_redundant(map: &Map) -> Option<KeyframeId> {
    let removable = map.keyframe_count().saturating_sub(RECENT_KEYFRAMES);
    let mut best: Option<(f64, KeyframeId)> = None;
    for (id, _) in map.keyframes().take(removable) {
        let share = redundant_share(map, id);
        if best.is_none_or(|(highest, _)| share > highest) {
            best = Some((share, id));
        }
    }
    best.map(|(_, id)| id)
}

/// Removes the points with fewest sightings, of equals the oldest.
fn remove_excess_points(map: &mut Map, points_max: usize) {
    let excess = map.point_count().saturating_sub(points_max);
    if excess == 0 {
        return;
    }
    let mut order: Vec<(usize, PointId)> = map.points().map(|(id, point)| (point.seen().len(), id)).collect();
    order.sort_unstable();
    for (_, id) in order.into_iter().take(excess) {
        map.remove_point(id);
    }
}
