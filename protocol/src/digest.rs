//! Digest of a model: whether server and viewer hold the same surfels in the same versions.
//!
//! The sum (mod 2^32) of a hash of each surfel's id and version, so it follows additions, updates and
//! removals in constant time each, in any order. 32-bit arithmetic throughout: browsers do it natively.

/// Hash of one surfel: id and the epoch in which it last changed.
///
/// `MurmurHash3`'s 32-bit finalizer over `id * 0x9E3779B1 + version * 0x85EBCA77` (mod 2^32).
pub fn surfel_digest(id: u32, version: u32) -> u32 {
    let mut h = id.wrapping_mul(0x9E37_79B1).wrapping_add(version.wrapping_mul(0x85EB_CA77));
    h ^= h >> 16;
    h = h.wrapping_mul(0x85EB_CA6B);
    h ^= h >> 13;
    h = h.wrapping_mul(0xC2B2_AE35);
    h ^ (h >> 16)
}

/// The digest of a model; that of the empty model is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Digest(u32);

impl Digest {
    /// Takes a surfel in.
    pub fn insert(&mut self, id: u32, version: u32) {
        self.0 = self.0.wrapping_add(surfel_digest(id, version));
    }

    /// Takes a surfel out.
    pub fn remove(&mut self, id: u32, version: u32) {
        self.0 = self.0.wrapping_sub(surfel_digest(id, version));
    }

    /// The value on the wire.
    pub fn value(self) -> u32 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_specification() {
        assert_eq!(surfel_digest(0, 0), 0);
        assert_eq!(surfel_digest(1, 1), 0x8CD2_2B09);
        assert_eq!(surfel_digest(2, 1), 0x21FA_7246);
        assert_eq!(surfel_digest(0xFFFF_FFFF, 7), 0xD0B0_3CF6);
    }

    #[test]
    fn the_order_of_changes_does_not_matter() {
        let (mut a, mut b) = (Digest::default(), Digest::default());
        a.insert(1, 1);
        a.insert(2, 1);
        a.remove(1, 1);
        b.insert(2, 1);
        assert_eq!(a, b);
    }

    #[test]
    fn an_update_changes_it() {
        let (mut a, mut b) = (Digest::default(), Digest::default());
        a.insert(1, 1);
        b.insert(1, 2);
        assert_ne!(a, b);
    }
}
