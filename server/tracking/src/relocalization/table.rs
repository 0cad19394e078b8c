//! One hash table of binary descriptors: some bits of a descriptor are its key (Indyk and Motwani 1998).

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

use crate::feature::Descriptor;

/// Bits of a key. A table has `2^KEY_BITS` buckets.
const KEY_BITS: usize = 13;
/// Bits of a descriptor.
const DESCRIPTOR_BITS: usize = 256;

/// A descriptor of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    /// Number of the place.
    pub place: u16,
    /// Number of the descriptor there.
    pub descriptor: u16,
}

/// Descriptors by some of their bits.
#[derive(Clone, Debug)]
pub(super) struct Table {
    bits: [u8; KEY_BITS],
    buckets: Vec<Vec<Entry>>,
}

impl Table {
    /// An empty table; each seed chooses its bits.
    pub fn new(seed: u128) -> Self {
        let mut random = Pcg64Mcg::new(seed);
        let mut all: Vec<u8> = (0..DESCRIPTOR_BITS).map(|bit| bit as u8).collect();
        let bits = std::array::from_fn(|_| all.swap_remove(random.random_range(0..all.len())));
        Self { bits, buckets: vec![Vec::new(); 1 << KEY_BITS] }
    }

    fn key(&self, descriptor: &Descriptor) -> usize {
        let bit = |bit: u8| (descriptor.0[usize::from(bit >> 6)] >> (bit & 63)) & 1;
        self.bits.iter().fold(0, |key, &place| key << 1 | bit(place) as usize)
    }

    pub fn insert(&mut self, descriptor: &Descriptor, entry: Entry) {
        let key = self.key(descriptor);
        self.buckets[key].push(entry);
    }

    pub fn remove(&mut self, descriptor: &Descriptor, entry: Entry) {
        let key = self.key(descriptor);
        self.buckets[key].retain(|other| *other != entry);
    }

    /// Entries with the descriptor's key, and with those that differ in one bit (multi-probe, Lv et al. 2007).
    pub fn near(&self, descriptor: &Descriptor) -> impl Iterator<Item = Entry> {
        let key = self.key(descriptor);
        let probes = std::iter::once(key).chain((0..KEY_BITS).map(move |bit| key ^ 1 << bit));
        probes.flat_map(|key| self.buckets[key].iter().copied())
    }
}
