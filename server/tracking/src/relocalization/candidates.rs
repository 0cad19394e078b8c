//! Keyframes worth a geometric check: similar ones, of which the neighbours are similar too.

use std::collections::BTreeMap;

use super::index::{PlaceIndex, Similarity};
use crate::feature::Descriptor;
use crate::map::{KeyframeId, Map, covisible};

/// Neighbours whose similarity counts.
const NEIGHBOURS: usize = 5;

/// A keyframe that may show the same place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The most similar of its group.
    pub keyframe: KeyframeId,
    /// Its own similarity.
    pub share: f64,
    /// Similarity summed over it and its neighbours: a place that was really seen resembles from several sides.
    pub group_share: f64,
}

/// The best keyframe of each group of neighbours among those that `eligible` lets pass, the best group first.
pub fn candidates(
    index: &PlaceIndex,
    map: &Map,
    descriptors: &[Descriptor],
    distance_max_bits: u32,
    eligible: impl Fn(KeyframeId) -> bool,
) -> Vec<Candidate> {
    let eligible = |id: KeyframeId| eligible(id) && map.keyframe(id).is_some();
    let found = index.similar(descriptors, distance_max_bits, eligible);
    let shares: BTreeMap<KeyframeId, f64> =
        found.iter().map(|similarity| (similarity.keyframe, similarity.share)).collect();
    let mut taken: Vec<KeyframeId> = Vec::new();
    let mut groups = Vec::new();
    for Similarity { keyframe, share } in found {
        if taken.contains(&keyframe) {
            continue;
        }
        let neighbours: Vec<KeyframeId> =
            covisible(map, keyframe).into_iter().take(NEIGHBOURS).map(|(id, _)| id).collect();
        let group_share = share + neighbours.iter().filter_map(|id| shares.get(id)).sum::<f64>();
        taken.push(keyframe);
        taken.extend(neighbours);
        groups.push(Candidate { keyframe, share, group_share });
    }
    groups.sort_by(|a, b| b.group_share.total_cmp(&a.group_share).then(b.keyframe.cmp(&a.keyframe)));
    groups
}
