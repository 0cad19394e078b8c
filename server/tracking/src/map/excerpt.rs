//! A part of the map to work on elsewhere while the map itself goes on.

use std::collections::BTreeSet;

use super::{KeyframeId, Map, PointId};

/// Points made in an excerpt have ids from here on, which no point of a whole map reaches.
const FIRST_PROVISIONAL: u64 = 1 << 63;

impl PointId {
    /// The place of a point that was made in an [`excerpt`] among those made there; `None` for points of a whole map.
    pub fn provisional_index(self) -> Option<usize> {
        self.0.checked_sub(FIRST_PROVISIONAL).map(|index| index as usize)
    }
}

impl Map {
    /// Forgets the sightings by keyframes that are not here.
    pub fn drop_dangling(&mut self) {
        for point in self.points.values_mut() {
            point.seen.retain(|seen| self.keyframes.contains_key(&seen.keyframe));
        }
    }
}

/// A copy of some keyframes and of the points that the first `with_points` of them see; links to what is left out dangle.
pub fn excerpt(map: &Map, keyframes: &[KeyframeId], with_points: usize) -> Map {
    let mut part = Map { next_keyframe: map.next_keyframe, next_point: FIRST_PROVISIONAL, ..Map::default() };
    for id in keyframes {
        if let Some(keyframe) = map.keyframes.get(id) {
            part.keyframes.insert(*id, keyframe.clone());
        }
    }
    let seeing = keyframes.iter().take(with_points).filter_map(|id| map.keyframes.get(id));
    let ids: BTreeSet<PointId> =
        seeing.flat_map(|keyframe| keyframe.points.iter().flatten().copied()).collect();
    part.points = ids.into_iter().filter_map(|id| Some((id, map.points.get(&id)?.clone()))).collect();
    part
}
