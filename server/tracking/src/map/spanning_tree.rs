//! The tree over all keyframes: each hangs on the older one that it shares most points with.

use super::{KeyframeId, Map, covisible};

impl Map {
    /// Hangs a keyframe on the older one that shares most points with it, or else on the one before it.
    pub fn adopt(&mut self, id: KeyframeId) {
        let sharing = covisible(self, id).into_iter().map(|(other, _)| other).find(|other| *other < id);
        let before = || self.keyframes.range(..id).next_back().map(|(other, _)| *other);
        let parent = sharing.or_else(before);
        if let Some(keyframe) = self.keyframes.get_mut(&id) {
            keyframe.parent = parent;
        }
    }

    /// Hangs the children of a removed keyframe on its parent, or, where it was a root, each on what it shares most with.
    pub(super) fn entrust_children(&mut self, removed: KeyframeId, parent: Option<KeyframeId>) {
        let children: Vec<KeyframeId> = self
            .keyframes
            .iter()
            .filter(|(_, keyframe)| keyframe.parent == Some(removed))
            .map(|(id, _)| *id)
            .collect();
        for child in children {
            match (parent, self.keyframes.get_mut(&child)) {
                (Some(_), Some(keyframe)) => keyframe.parent = parent,
                _ => self.adopt(child),
            }
        }
    }
}
