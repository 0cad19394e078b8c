//! Surfels sorted by id, each with the epoch of its last change and whatever its holder keeps of it.

use crate::{Digest, ProtocolError};

/// Ids, versions and rows side by side, with the digest over ids and versions.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfelTable<R> {
    ids: Vec<u32>,
    versions: Vec<u32>,
    rows: Vec<R>,
    digest: Digest,
}

impl<R> Default for SurfelTable<R> {
    fn default() -> Self {
        Self { ids: Vec::new(), versions: Vec::new(), rows: Vec::new(), digest: Digest::default() }
    }
}

/// Changes to a table: each list sorted by id.
#[derive(Clone, Copy, Debug)]
pub struct TableChanges<'a, S> {
    /// Ids to take away; they must be held.
    pub removed: &'a [u32],
    /// Rows to replace; they must be held and not be taken away.
    pub updated: &'a [(u32, S)],
    /// New rows; they must not be held.
    pub added: &'a [(u32, S)],
}

impl<R: Copy> SurfelTable<R> {
    /// From surfels in any order.
    ///
    /// # Errors
    /// [`ProtocolError::AlreadyHeld`] where an id comes twice.
    pub fn collect(mut surfels: Vec<(u32, u32, R)>) -> Result<Self, ProtocolError> {
        surfels.sort_unstable_by_key(|(id, ..)| *id);
        let twice = surfels.windows(2).find(|pair| pair[0].0 == pair[1].0);
        if let Some(&[(id, ..), ..]) = twice {
            return Err(ProtocolError::AlreadyHeld { what: "surfel", id });
        }
        let mut table = Self::default();
        surfels.into_iter().for_each(|(id, version, row)| table.push(id, version, row));
        Ok(table)
    }

    /// Surfels held.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Ids, increasing.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Epochs of the last changes, in the order of the ids.
    pub fn versions(&self) -> &[u32] {
        &self.versions
    }

    /// Rows, in the order of the ids.
    pub fn rows(&self) -> &[R] {
        &self.rows
    }

    /// Rows, in the order of the ids; what they hold is no part of the digest.
    pub fn rows_mut(&mut self) -> &mut [R] {
        &mut self.rows
    }

    /// Digest over ids and versions.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// Place of an id.
    pub fn index_of(&self, id: u32) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// The digest after `changes` at `epoch`; the table is not changed.
    ///
    /// # Errors
    /// [`ProtocolError::NotHeld`], [`ProtocolError::AlreadyHeld`].
    pub fn digest_after<S>(&self, epoch: u32, changes: &TableChanges<S>) -> Result<Digest, ProtocolError> {
        let mut digest = self.digest;
        let version = |id: u32| {
            let index = self.index_of(id).ok_or(ProtocolError::NotHeld { what: "surfel", id })?;
            Ok(self.versions[index])
        };
        for &id in changes.removed {
            digest.remove(id, version(id)?);
        }
        for &(id, _) in changes.updated {
            if changes.removed.binary_search(&id).is_ok() {
                return Err(ProtocolError::NotHeld { what: "surfel", id });
            }
            digest.remove(id, version(id)?);
            digest.insert(id, epoch);
        }
        for &(id, _) in changes.added {
            if self.index_of(id).is_some() {
                return Err(ProtocolError::AlreadyHeld { what: "surfel", id });
            }
            digest.insert(id, epoch);
        }
        Ok(digest)
    }

    /// Carries out changes that [`Self::digest_after`] has accepted.
    pub fn apply<S>(&mut self, epoch: u32, changes: &TableChanges<S>, row: impl Fn(&S) -> R) {
        for (id, new) in changes.updated {
            let Some(index) = self.index_of(*id) else { continue };
            self.digest.remove(*id, self.versions[index]);
            self.digest.insert(*id, epoch);
            self.versions[index] = epoch;
            self.rows[index] = row(new);
        }
        if !changes.removed.is_empty() || !changes.added.is_empty() {
            self.merge(epoch, changes, row);
        }
    }

    /// One pass over held, removed and added ids, all of them sorted.
    fn merge<S>(&mut self, epoch: u32, changes: &TableChanges<S>, row: impl Fn(&S) -> R) {
        let held = std::mem::take(self);
        self.reserve(held.len() + changes.added.len());
        let mut removed = changes.removed.iter().peekable();
        let mut added = changes.added.iter().peekable();
        for ((&id, &version), &kept) in held.ids.iter().zip(&held.versions).zip(&held.rows) {
            while let Some((new_id, new)) = added.next_if(|(new_id, _)| *new_id < id) {
                self.push(*new_id, epoch, row(new));
            }
            if removed.next_if_eq(&&id).is_none() {
                self.push(id, version, kept);
            }
        }
        added.for_each(|(id, new)| self.push(*id, epoch, row(new)));
    }

    fn reserve(&mut self, surfels: usize) {
        self.ids.reserve(surfels);
        self.versions.reserve(surfels);
        self.rows.reserve(surfels);
    }

    fn push(&mut self, id: u32, version: u32, row: R) {
        self.ids.push(id);
        self.versions.push(version);
        self.rows.push(row);
        self.digest.insert(id, version);
    }
}
