//! All keyframes' descriptors, so that those similar to a given one are found without looking at all.
//!
//! Several hash tables over different bits (locality-sensitive hashing, probed at and beside the key): two sightings of a corner
//! that differ in 30 of 256 bits meet in one of six tables of 13 bits with 98 %, two strangers in one of 600.

use crate::feature::Descriptor;
use crate::map::KeyframeId;

use super::table::{Entry, Table};

/// Hash tables.
const TABLES: u128 = 6;
/// Most descriptors asked for of one image: an even choice of more.
const ASKED_MAX: usize = 300;
/// Places and descriptors per place that an entry can name.
const NUMBER_MAX: usize = u16::MAX as usize;

/// An index of keyframes by their descriptors.
#[derive(Clone, Debug)]
pub struct PlaceIndex {
    tables: Vec<Table>,
    /// Numbers of removed places are used again.
    places: Vec<Option<Place>>,
}

#[derive(Clone, Debug)]
struct Place {
    keyframe: KeyframeId,
    descriptors: Vec<Descriptor>,
}

/// How much of an image a keyframe shows too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// The keyframe.
    pub keyframe: KeyframeId,
    /// Share of the image's descriptors that no other keyframe has a more similar one of.
    pub share: f64,
}

impl PlaceIndex {
    /// An empty index.
    pub fn new() -> Self {
        Self { tables: (1..=TABLES).map(Table::new).collect(), places: Vec::new() }
    }

    /// Number of keyframes.
    pub fn len(&self) -> usize {
        self.places.iter().flatten().count()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a keyframe; nothing happens where it is known already, or the index full.
    pub fn insert(&mut self, keyframe: KeyframeId, descriptors: impl FnOnce() -> Vec<Descriptor>) {
        if self.number_of(keyframe).is_some() {
            return;
        }
        let number = self.places.iter().position(Option::is_none).unwrap_or(self.places.len());
        if number >= NUMBER_MAX {
            return;
        }
        let mut descriptors = descriptors();
        descriptors.truncate(NUMBER_MAX);
        for (entry, descriptor) in entries(number, &descriptors) {
            for table in &mut self.tables {
                table.insert(descriptor, entry);
            }
        }
        let place = Some(Place { keyframe, descriptors });
        match self.places.get_mut(number) {
            Some(free) => *free = place,
            None => self.places.push(place),
        }
    }

    /// Forgets a keyframe.
    pub fn remove(&mut self, keyframe: KeyframeId) {
        let Some(number) = self.number_of(keyframe) else { return };
        let Some(place) = self.places[number].take() else { return };
        for (entry, descriptor) in entries(number, &place.descriptors) {
            for table in &mut self.tables {
                table.remove(descriptor, entry);
            }
        }
    }

    /// Forgets the keyframes that `keep` refuses.
    pub fn retain(&mut self, keep: impl Fn(KeyframeId) -> bool) {
        let gone: Vec<KeyframeId> =
            self.places.iter().flatten().map(|place| place.keyframe).filter(|id| !keep(*id)).collect();
        for keyframe in gone {
            self.remove(keyframe);
        }
    }

    /// Which keyframes an image looks like, of those that `eligible` lets pass; the most similar first, of equals the newer.
    ///
    /// Corners of tissue resemble each other, so what counts is not that a keyframe has a similar one (nearly all have), but that it has
    /// the most similar one: each of the image's descriptors votes for one keyframe.
    pub fn similar(
        &self,
        descriptors: &[Descriptor],
        distance_max_bits: u32,
        eligible: impl Fn(KeyframeId) -> bool,
    ) -> Vec<Similarity> {
        let may_win: Vec<bool> = self
            .places
            .iter()
            .map(|place| place.as_ref().is_some_and(|place| eligible(place.keyframe)))
            .collect();
        if !may_win.contains(&true) {
            return Vec::new();
        }
        let step = descriptors.len().div_ceil(ASKED_MAX).max(1);
        let asked = descriptors.iter().step_by(step);
        let mut votes = vec![0_u32; self.places.len()];
        for descriptor in asked.clone() {
            let entries = self.tables.iter().flat_map(|table| table.near(descriptor));
            let entries = entries.filter(|entry| may_win[usize::from(entry.place)]);
            let nearest = entries.map(|entry| (self.distance(entry, descriptor), entry.place)).min();
            if let Some((_, place)) = nearest.filter(|(distance, _)| *distance <= distance_max_bits) {
                votes[usize::from(place)] += 1;
            }
        }
        let count = asked.count().max(1) as f64;
        let found = self.places.iter().zip(votes).filter_map(|(place, votes)| {
            let keyframe = place.as_ref()?.keyframe;
            (votes > 0).then(|| Similarity { keyframe, share: f64::from(votes) / count })
        });
        let mut found: Vec<Similarity> = found.collect();
        found.sort_by(|a, b| b.share.total_cmp(&a.share).then(b.keyframe.cmp(&a.keyframe)));
        found
    }

    fn distance(&self, entry: Entry, descriptor: &Descriptor) -> u32 {
        let place = self.places[usize::from(entry.place)].as_ref();
        place.map_or(u32::MAX, |place| place.descriptors[usize::from(entry.descriptor)].distance(descriptor))
    }

    fn number_of(&self, keyframe: KeyframeId) -> Option<usize> {
        self.places.iter().position(|place| place.as_ref().is_some_and(|place| place.keyframe == keyframe))
    }
}

impl Default for PlaceIndex {
    fn default() -> Self {
        Self::new()
    }
}

fn entries(place: usize, descriptors: &[Descriptor]) -> impl Iterator<Item = (Entry, &Descriptor)> {
    descriptors
        .iter()
        .enumerate()
        .map(move |(descriptor, value)| (Entry { place: place as u16, descriptor: descriptor as u16 }, value))
}

#[cfg(test)]
mod tests {
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    use super::*;

    fn noisy(descriptor: &Descriptor, bits: usize, random: &mut Pcg64Mcg) -> Descriptor {
        let mut noisy = *descriptor;
        for _ in 0..bits {
            noisy.0[random.random_range(0..4)] ^= 1 << random.random_range(0..64);
        }
        noisy
    }

    fn places(count: u64) -> (PlaceIndex, Vec<(KeyframeId, Vec<Descriptor>)>, Pcg64Mcg) {
        let mut random = Pcg64Mcg::new(9);
        let mut index = PlaceIndex::new();
        let mut all = Vec::new();
        for number in 0..count {
            let descriptors: Vec<Descriptor> = (0..300).map(|_| Descriptor(random.random())).collect();
            let id = KeyframeId::of(number);
            index.insert(id, || descriptors.clone());
            all.push((id, descriptors));
        }
        (index, all, random)
    }

    #[test]
    fn a_place_seen_again_with_noise_comes_first_by_far() {
        let (index, all, mut random) = places(40);
        let (id, descriptors) = &all[23];
        let again: Vec<Descriptor> = descriptors.iter().map(|d| noisy(d, 30, &mut random)).collect();
        let found = index.similar(&again, 50, |_| true);
        assert_eq!(found[0].keyframe, *id);
        assert!(found[0].share > 0.9, "{}", found[0].share);
        assert!(found.get(1).is_none_or(|second| second.share < 0.05));
    }

    #[test]
    fn what_was_removed_is_not_found_and_its_number_is_used_again() {
        let (mut index, all, _) = places(3);
        index.remove(all[1].0);
        assert!(index.similar(&all[1].1, 50, |_| true).is_empty());
        assert_eq!(index.len(), 2);
        index.insert(all[1].0, || all[1].1.clone());
        assert_eq!(index.similar(&all[1].1, 50, |_| true)[0].share, 1.0);
        index.retain(|id| id == all[0].0);
        assert_eq!(index.len(), 1);
        assert!(index.similar(&all[2].1, 50, |_| true).is_empty());
    }

    #[test]
    fn only_those_that_may_win_get_votes() {
        let (index, all, _) = places(3);
        assert!(index.similar(&all[1].1, 50, |id| id == all[0].0).is_empty());
        assert_eq!(index.similar(&all[1].1, 50, |id| id != all[0].0)[0].keyframe, all[1].0);
    }

    #[test]
    fn nothing_resembles_nothing() {
        let (index, all, _) = places(1);
        assert!(index.similar(&[], 50, |_| true).is_empty());
        assert!(PlaceIndex::new().similar(&all[0].1, 50, |_| true).is_empty());
    }
}
