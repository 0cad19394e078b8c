//! The model as every viewer holds it: packed surfels by id, brought forward by epochs.
//!
//! The server keeps one to seed late joiners; a viewer keeps one to check that it holds the same.
//! Both go through the same code, so what a snapshot holds is what the epochs before it built.

use crate::digest::Digest;
use crate::limits::SNAPSHOT_CHUNK_SURFELS;
use crate::packed::{pack_ids, unpack_ids, unpack_records, unpack_versions};
use crate::v1::{ModelEpoch, PackedSurfels, SnapshotChunk};
use crate::{ProtocolError, RECORD_BYTES, SurfelRecord, WireSurfel};

/// Surfels sorted by id, with the epoch in which each last changed.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct PackedModel {
    epoch: u32,
    stamp_ns: u64,
    ids: Vec<u32>,
    versions: Vec<u32>,
    records: Vec<SurfelRecord>,
    digest: Digest,
}

impl PackedModel {
    /// The epoch that it stands at; 0 before the first.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Surfels held.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether it holds none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Digest over ids and versions.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// Whether it holds a surfel of this id.
    pub fn holds(&self, id: u32) -> bool {
        self.ids.binary_search(&id).is_ok()
    }

    /// Ids held, increasing.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// All surfels, by increasing id.
    pub fn surfels(&self) -> impl Iterator<Item = WireSurfel> + '_ {
        self.ids.iter().zip(&self.records).map(|(&id, record)| record.unpack(id))
    }

    /// Server side: applies changes and completes them with the digest and the count.
    ///
    /// # Errors
    /// As [`Self::apply`], the digest excepted; the model is then unchanged.
    pub fn advance(&mut self, mut changes: ModelEpoch) -> Result<ModelEpoch, ProtocolError> {
        *self = self.merged(&changes)?;
        changes.digest = self.digest.value();
        changes.surfels = self.len() as u32;
        Ok(changes)
    }

    /// Viewer side: applies an epoch and checks that the model is then the server's.
    ///
    /// # Errors
    /// Malformed arrays, another base epoch, ids that should be held and are not or the other way round,
    /// another digest. The model is then unchanged and wants a snapshot.
    pub fn apply(&mut self, epoch: &ModelEpoch) -> Result<(), ProtocolError> {
        let merged = self.merged(epoch)?;
        merged.expect_digest(epoch.digest)?;
        *self = merged;
        Ok(())
    }

    fn merged(&self, epoch: &ModelEpoch) -> Result<Self, ProtocolError> {
        if epoch.base_epoch != self.epoch {
            return Err(ProtocolError::WrongBase { held: self.epoch, base: epoch.base_epoch });
        }
        let changes = Changes::unpack(epoch)?;
        let mut merged = Self::with_capacity(epoch, self.len() + changes.added.len());
        changes.merge_into(self, &mut merged)?;
        Ok(merged)
    }

    fn with_capacity(epoch: &ModelEpoch, surfels: usize) -> Self {
        Self {
            epoch: epoch.epoch,
            stamp_ns: epoch.stamp_ns,
            ids: Vec::with_capacity(surfels),
            versions: Vec::with_capacity(surfels),
            records: Vec::with_capacity(surfels),
            digest: Digest::default(),
        }
    }

    fn expect_digest(&self, expected: u32) -> Result<(), ProtocolError> {
        let got = self.digest.value();
        if got == expected {
            Ok(())
        } else {
            Err(ProtocolError::DigestMismatch { epoch: self.epoch, got, expected })
        }
    }

    fn push(&mut self, id: u32, version: u32, record: SurfelRecord) {
        self.ids.push(id);
        self.versions.push(version);
        self.records.push(record);
        self.digest.insert(id, version);
    }

    /// The changes that empty this model in the next epoch; for [`Self::advance`].
    pub fn clearing(&self) -> ModelEpoch {
        ModelEpoch {
            epoch: self.epoch + 1,
            base_epoch: self.epoch,
            stamp_ns: self.stamp_ns,
            removed_ids: pack_ids(&self.ids),
            ..ModelEpoch::default()
        }
    }

    /// The whole model in chunks of [`SNAPSHOT_CHUNK_SURFELS`], at least one.
    pub fn snapshot(&self) -> Vec<SnapshotChunk> {
        let count = self.len().div_ceil(SNAPSHOT_CHUNK_SURFELS).max(1);
        (0..count).map(|index| self.snapshot_chunk(index, count)).collect()
    }

    fn snapshot_chunk(&self, index: usize, count: usize) -> SnapshotChunk {
        let start = index * SNAPSHOT_CHUNK_SURFELS;
        let range = start..(start + SNAPSHOT_CHUNK_SURFELS).min(self.len());
        let mut records = Vec::with_capacity(range.len() * RECORD_BYTES);
        records.extend(self.records[range.clone()].iter().flat_map(|record| record.0));
        SnapshotChunk {
            epoch: self.epoch,
            stamp_ns: self.stamp_ns,
            index: index as u32,
            count: count as u32,
            surfels: Some(PackedSurfels { ids: pack_ids(&self.ids[range.clone()]), records: records.into() }),
            versions: pack_ids(&self.versions[range]),
            digest: self.digest.value(),
        }
    }
}

/// Collects the chunks of one snapshot.
#[derive(Debug, Default)]
pub struct SnapshotAssembly {
    model: PackedModel,
    next_index: u32,
}

impl SnapshotAssembly {
    /// Takes the next chunk in; the model once it was the last. Chunk 0 starts anew at any time.
    ///
    /// # Errors
    /// Malformed arrays, a missing chunk, another digest.
    pub fn push(&mut self, chunk: &SnapshotChunk) -> Result<Option<PackedModel>, ProtocolError> {
        if chunk.index == 0 {
            self.model =
                PackedModel { epoch: chunk.epoch, stamp_ns: chunk.stamp_ns, ..PackedModel::default() };
        } else if chunk.index != self.next_index || chunk.epoch != self.model.epoch {
            return Err(ProtocolError::MissingChunk { expected: self.next_index, got: chunk.index });
        }
        self.next_index = chunk.index.saturating_add(1);
        self.extend(chunk)?;
        if self.next_index < chunk.count {
            return Ok(None);
        }
        let model = std::mem::take(&mut self.model);
        model.expect_digest(chunk.digest)?;
        Ok(Some(model))
    }

    fn extend(&mut self, chunk: &SnapshotChunk) -> Result<(), ProtocolError> {
        let (ids, records) = unpack_records(chunk.surfels.as_ref().unwrap_or(&PackedSurfels::default()))?;
        let versions = unpack_versions(&chunk.versions, ids.len())?;
        if let (Some(&previous), Some(&id)) = (self.model.ids.last(), ids.first())
            && previous >= id
        {
            return Err(ProtocolError::UnsortedIds { index: self.model.len(), id, previous });
        }
        for ((id, version), record) in ids.into_iter().zip(versions).zip(records) {
            self.model.push(id, version, record);
        }
        Ok(())
    }
}

/// The checked arrays of an epoch.
struct Changes {
    removed: Vec<u32>,
    added: Vec<(u32, SurfelRecord)>,
    updated: Vec<(u32, SurfelRecord)>,
}

impl Changes {
    fn unpack(epoch: &ModelEpoch) -> Result<Self, ProtocolError> {
        let block = |packed: &Option<PackedSurfels>| -> Result<Vec<_>, ProtocolError> {
            let Some(packed) = packed else { return Ok(Vec::new()) };
            let (ids, records) = unpack_records(packed)?;
            Ok(ids.into_iter().zip(records).collect())
        };
        Ok(Self {
            removed: unpack_ids("removed_ids", &epoch.removed_ids)?,
            added: block(&epoch.added)?,
            updated: block(&epoch.updated)?,
        })
    }

    /// One pass over held and changed ids, all of them sorted.
    fn merge_into(self, held: &PackedModel, merged: &mut PackedModel) -> Result<(), ProtocolError> {
        let mut removed = self.removed.into_iter().peekable();
        let mut added = self.added.into_iter().peekable();
        let mut updated = self.updated.into_iter().peekable();
        for ((&id, &version), &record) in held.ids.iter().zip(&held.versions).zip(&held.records) {
            while let Some((new_id, new)) = added.next_if(|(new_id, _)| *new_id < id) {
                merged.push(new_id, merged.epoch, new);
            }
            if added.next_if(|(new_id, _)| *new_id == id).is_some() {
                return Err(ProtocolError::AlreadyHeld { id });
            }
            let gone = removed.next_if_eq(&id).is_some();
            match updated.next_if(|(changed, _)| *changed == id) {
                Some(_) if gone => return Err(ProtocolError::NotHeld { id }),
                Some((_, new)) => merged.push(id, merged.epoch, new),
                None if gone => {}
                None => merged.push(id, version, record),
            }
        }
        added.for_each(|(id, new)| merged.push(id, merged.epoch, new));
        match removed.next().or_else(|| updated.next().map(|(id, _)| id)) {
            Some(id) => Err(ProtocolError::NotHeld { id }),
            None => Ok(()),
        }
    }
}
