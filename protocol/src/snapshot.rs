//! Snapshots: the whole model in chunks that lie together in space and may come in any order.

use crate::limits::SNAPSHOT_CHUNK_SURFELS;
use crate::node::{pack_nodes, unpack_nodes};
use crate::packed::{pack_records, pack_versions, unpack_records, unpack_versions};
use crate::v1::SnapshotChunk;
use crate::{NodePosition, PackedModel, ProtocolError, SurfelRecord};

/// A chunk and where it lies.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedChunk {
    /// Mean of its surfels' positions; chunk 0, which holds the nodes and no surfels, has none.
    pub centre_in_world_m: Option<[f32; 3]>,
    /// What is sent.
    pub chunk: SnapshotChunk,
}

impl PackedModel {
    /// The model as chunk 0 with all nodes, then chunks of up to [`SNAPSHOT_CHUNK_SURFELS`] surfels.
    ///
    /// # Errors
    /// None in practice: ids are the model's own.
    pub fn snapshot(&self) -> Result<Vec<PlacedChunk>, ProtocolError> {
        let records = self.surfels().rows();
        let mut order: Vec<usize> = (0..records.len()).collect();
        order.sort_by_cached_key(|&index| (records[index].morton_code(), index));
        let runs: Vec<&[usize]> = order.chunks(SNAPSHOT_CHUNK_SURFELS).collect();
        let count = runs.len() as u32 + 1;
        let header = SnapshotChunk {
            epoch: self.epoch(),
            stamp_ns: self.stamp_ns(),
            index: 0,
            count,
            surfels: None,
            versions: Default::default(),
            digest: self.digest().value(),
            nodes: Some(pack_nodes(self.nodes().ids(), self.nodes().positions())?),
            surfels_total: records.len() as u32,
            node_reach_m: self.node_reach_m(),
        };
        let mut chunks = vec![PlacedChunk { centre_in_world_m: None, chunk: header.clone() }];
        for (run, index) in runs.into_iter().zip(1..) {
            let header = SnapshotChunk { index, nodes: None, ..header.clone() };
            chunks.push(self.placed_chunk(run.to_vec(), header)?);
        }
        Ok(chunks)
    }

    fn placed_chunk(&self, mut run: Vec<usize>, header: SnapshotChunk) -> Result<PlacedChunk, ProtocolError> {
        run.sort_unstable();
        let table = self.surfels();
        let ids: Vec<u32> = run.iter().map(|&index| table.ids()[index]).collect();
        let records: Vec<SurfelRecord> = run.iter().map(|&index| table.rows()[index]).collect();
        let mut sum = [0.0_f64; 3];
        for record in &records {
            let position = record.position_in_world_m();
            sum.iter_mut().zip(position).for_each(|(sum, value)| *sum += f64::from(value));
        }
        let centre = sum.map(|sum| (sum / records.len() as f64) as f32);
        let versions = pack_versions(run.iter().map(|&index| table.versions()[index]), header.epoch);
        let surfels = Some(pack_records(&ids, &records)?);
        Ok(PlacedChunk {
            centre_in_world_m: Some(centre),
            chunk: SnapshotChunk { surfels, versions, ..header },
        })
    }
}

/// The checked arrays of a chunk.
#[derive(Clone, Debug, PartialEq)]
pub struct ChunkContents {
    /// Id, version, record.
    pub surfels: Vec<(u32, u32, SurfelRecord)>,
    /// All nodes of the model, in chunk 0.
    pub nodes: Option<Vec<(u32, NodePosition)>>,
}

impl ChunkContents {
    /// Reads a chunk.
    ///
    /// # Errors
    /// [`ProtocolError`] naming the array that is malformed, or an index that is not below the count.
    pub fn unpack(chunk: &SnapshotChunk) -> Result<Self, ProtocolError> {
        if chunk.index >= chunk.count {
            return Err(ProtocolError::ChunkIndex { index: chunk.index, count: chunk.count });
        }
        let records = chunk.surfels.as_ref().map_or(Ok(Vec::new()), unpack_records)?;
        let versions = unpack_versions(&chunk.versions, chunk.epoch, records.len())?;
        let surfels = records.into_iter().zip(versions).map(|((id, record), version)| (id, version, record));
        let nodes = chunk.nodes.as_ref().map(unpack_nodes).transpose()?;
        Ok(Self { surfels: surfels.collect(), nodes })
    }
}
