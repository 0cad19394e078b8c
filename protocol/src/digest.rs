//! Digest of a model: whether server and viewer hold the same surfels in the same versions, and the same nodes in the
//! same places.
//!
//! The sum (mod 2^32) of a hash of each surfel's id and version and of each node's id and position, so it follows
//! changes in constant time each, in any order. 32-bit arithmetic throughout: browsers do it natively.

use crate::NodePosition;

/// Hash of one surfel: id and the epoch in which it last changed.
///
/// `MurmurHash3`'s 32-bit finalizer over `id * 0x9E3779B1 + version * 0x85EBCA77` (mod 2^32).
pub fn surfel_digest(id: u32, version: u32) -> u32 {
    mixed(id.wrapping_mul(0x9E37_79B1).wrapping_add(version.wrapping_mul(0x85EB_CA77)))
}

/// Hash of one node: id and place. A missed or wrongly applied warp leaves nodes elsewhere.
///
/// The finalizer over `id * 0x27D4EB2F + x * 0x165667B1 + y * 0x9E3779B1 + z * 0x85EBCA77 + 1` (mod 2^32).
pub fn node_digest(id: u32, NodePosition([x, y, z]): NodePosition) -> u32 {
    let sum = id.wrapping_mul(0x27D4_EB2F).wrapping_add((x as u32).wrapping_mul(0x1656_67B1));
    let sum = sum.wrapping_add((y as u32).wrapping_mul(0x9E37_79B1));
    mixed(sum.wrapping_add((z as u32).wrapping_mul(0x85EB_CA77)).wrapping_add(1))
}

/// `MurmurHash3`'s 32-bit finalizer.
fn mixed(mut h: u32) -> u32 {
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

    /// Takes a node in.
    pub fn insert_node(&mut self, id: u32, position: NodePosition) {
        self.0 = self.0.wrapping_add(node_digest(id, position));
    }

    /// The digest of both parts together.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
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
