//! Keeps the map small and trustworthy.

use crate::config::MapConfig;
use crate::map::{KeyframeId, Map, PointId};

/// A point must have been expected this often before its share of being found says anything.
const EXPECTED_MIN: u32 = 8;
/// The latest keyframes are never removed.
const RECENT_KEYFRAMES: usize = 5;
/// A keyframe's point is redundant if this many keyframes see it.
const REDUNDANT_SIGHTINGS: usize = 4;

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
    let redundancy = |id: KeyframeId| {
        let points: Vec<PointId> = map.keyframe(id)?.points().iter().flatten().copied().collect();
        let seen_elsewhere = points
            .iter()
            .filter(|&&point| map.point(point).is_some_and(|point| point.seen().len() >= REDUNDANT_SIGHTINGS))
            .count();
        Some(if points.is_empty() { 1.0 } else { seen_elsewhere as f64 / points.len() as f64 })
    };
    let mut best: Option<(f64, KeyframeId)> = None;
    for (id, _) in map.keyframes().take(removable) {
        let share = redundancy(id)?;
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
