//! The contents of a model epoch, checked.

use crate::node::{unpack_nodes, unpack_transforms};
use crate::packed::{unpack_ids, unpack_records};
use crate::table::TableChanges;
use crate::v1::{ModelEpoch, PackedSurfels};
use crate::{NodePosition, NodeTable, NodeTransform, ProtocolError, SurfelRecord};

/// All arrays of a [`ModelEpoch`].
#[derive(Clone, Debug, PartialEq, Default)]
pub struct EpochChanges {
    /// Motion of all nodes held before the epoch, by id; empty where nothing deforms.
    pub transforms: Vec<NodeTransform>,
    /// Nodes taken away after that.
    pub removed_nodes: Vec<u32>,
    /// Nodes that come to it after that.
    pub added_nodes: Vec<(u32, NodePosition)>,
    /// Surfels taken away, by id.
    pub removed: Vec<u32>,
    /// Surfels replaced, by id.
    pub updated: Vec<(u32, SurfelRecord)>,
    /// New surfels, by id.
    pub added: Vec<(u32, SurfelRecord)>,
}

impl EpochChanges {
    /// Reads an epoch that applies to a model with `nodes` nodes.
    ///
    /// # Errors
    /// [`ProtocolError`] naming the array that is malformed.
    pub fn unpack(epoch: &ModelEpoch, nodes: usize) -> Result<Self, ProtocolError> {
        let block = |packed: &Option<PackedSurfels>| packed.as_ref().map_or(Ok(Vec::new()), unpack_records);
        let transforms = &epoch.node_transforms;
        Ok(Self {
            transforms: if transforms.is_empty() {
                Vec::new()
            } else {
                unpack_transforms(transforms, nodes)?
            },
            removed_nodes: unpack_ids("removed_node_ids", &epoch.removed_node_ids)?,
            added_nodes: epoch.added_nodes.as_ref().map_or(Ok(Vec::new()), unpack_nodes)?,
            removed: unpack_ids("removed_ids", &epoch.removed_ids)?,
            updated: block(&epoch.updated)?,
            added: block(&epoch.added)?,
        })
    }

    /// The nodes after the epoch.
    ///
    /// # Errors
    /// As [`NodeTable::after`].
    pub fn nodes_after(&self, held: &NodeTable) -> Result<NodeTable, ProtocolError> {
        held.after(&self.transforms, &self.removed_nodes, &self.added_nodes)
    }

    /// The part that concerns surfels.
    pub fn surfels(&self) -> TableChanges<'_, SurfelRecord> {
        TableChanges { removed: &self.removed, updated: &self.updated, added: &self.added }
    }
}
