//! The keyframes around the newest one that local bundle adjustment works on.

use std::collections::BTreeMap;

use crate::config::MappingConfig;
use crate::map::{KeyframeId, Map, covisible};

/// Keyframes to adjust, and those that hold them in place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Window {
    /// The newest, then those that share most points with it.
    pub free: Vec<KeyframeId>,
    /// Others that see the same points, most first.
    pub fixed: Vec<KeyframeId>,
}

impl Window {
    /// The window around a keyframe.
    pub fn around(map: &Map, newest: KeyframeId, config: &MappingConfig) -> Self {
        let mut free = vec![newest];
        let neighbours = covisible(map, newest).into_iter().map(|(id, _)| id);
        free.extend(neighbours.take(config.window_keyframes as usize - 1));
        let mut shared: BTreeMap<KeyframeId, u32> = BTreeMap::new();
        for (other, count) in free.iter().flat_map(|&id| covisible(map, id)) {
            if !free.contains(&other) {
                *shared.entry(other).or_default() += count;
            }
        }
        let mut order: Vec<(u32, KeyframeId)> = shared.into_iter().map(|(id, count)| (count, id)).collect();
        order.sort_unstable_by(|a, b| b.cmp(a));
        let fixed = order.into_iter().take(config.fixed_keyframes as usize).map(|(_, id)| id).collect();
        Self { free, fixed }
    }

    /// All of them, the free ones first.
    pub fn all(&self) -> Vec<KeyframeId> {
        self.free.iter().chain(&self.fixed).copied().collect()
    }
}
