//! A snapshot under way.

use std::collections::BTreeSet;

use protocol::v1::SnapshotChunk;
use protocol::{ChunkContents, NodeTable, ProtocolError, SurfelTable};

use crate::Surfel;

/// The chunks of one snapshot that have come so far, in any order.
#[derive(Clone, Debug)]
pub(crate) struct Seeding {
    pub epoch: u32,
    pub digest: u32,
    pub node_reach_m: f32,
    count: u32,
    seen: BTreeSet<u32>,
    surfels: Vec<(u32, u32, Surfel)>,
    nodes: NodeTable,
}

impl Seeding {
    /// The snapshot that `chunk` is of, still empty.
    pub fn new(chunk: &SnapshotChunk) -> Self {
        Self {
            epoch: chunk.epoch,
            digest: chunk.digest,
            node_reach_m: chunk.node_reach_m,
            count: chunk.count,
            seen: BTreeSet::new(),
            surfels: Vec::new(),
            nodes: NodeTable::default(),
        }
    }

    /// Whether the chunk is of the same snapshot.
    pub fn is_of(&self, chunk: &SnapshotChunk) -> bool {
        (self.epoch, self.digest, self.count) == (chunk.epoch, chunk.digest, chunk.count)
    }

    /// Takes a chunk in; one that came before changes nothing. True once all are there.
    pub fn take(&mut self, chunk: &SnapshotChunk) -> Result<bool, ProtocolError> {
        let contents = ChunkContents::unpack(chunk)?;
        if self.seen.insert(chunk.index) {
            let surfels = contents.surfels.iter().map(|(id, version, record)| (*id, *version, record.into()));
            self.surfels.extend(surfels);
            if let Some(nodes) = contents.nodes {
                self.nodes = NodeTable::from_sorted(nodes);
            }
        }
        Ok(self.seen.len() == self.count as usize)
    }

    /// Surfels so far.
    pub fn surfels(&self) -> impl ExactSizeIterator<Item = &Surfel> {
        self.surfels.iter().map(|(.., surfel)| surfel)
    }

    /// The whole model.
    pub fn complete(self) -> Result<(SurfelTable<Surfel>, NodeTable), ProtocolError> {
        Ok((SurfelTable::collect(self.surfels)?, self.nodes))
    }
}
