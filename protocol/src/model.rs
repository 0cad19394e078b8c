//! The server's account of what every viewer holds: versions and nodes exactly, shapes as far as it was told.
//!
//! A warp moves all surfels at the viewers, but not here: the account's shapes are then outdated until
//! [`PackedModel::refresh`] brings those that the GPU holds. A model that does not deform never needs that.

use crate::epoch::EpochChanges;
use crate::table::SurfelTable;
use crate::v1::ModelEpoch;
use crate::{Digest, NodeTable, ProtocolError, SurfelRecord, WireSurfel, pack_ids};

/// Packed surfels by id, and the node graph.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct PackedModel {
    epoch: u32,
    stamp_ns: u64,
    surfels: SurfelTable<SurfelRecord>,
    nodes: NodeTable,
    node_reach_m: f32,
    outdated: bool,
}

impl PackedModel {
    /// The epoch that it stands at; 0 before the first.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Stamp of the newest pair in it.
    pub fn stamp_ns(&self) -> u64 {
        self.stamp_ns
    }

    /// Ids, versions and records.
    pub fn surfels(&self) -> &SurfelTable<SurfelRecord> {
        &self.surfels
    }

    /// The node graph.
    pub fn nodes(&self) -> &NodeTable {
        &self.nodes
    }

    /// Reach of a node.
    pub fn node_reach_m(&self) -> f32 {
        self.node_reach_m
    }

    /// Digest over surfels and nodes.
    pub fn digest(&self) -> Digest {
        self.surfels.digest().joined(self.nodes.digest())
    }

    /// Whether a warp has moved surfels since their records were made.
    pub fn is_outdated(&self) -> bool {
        self.outdated
    }

    /// Applies changes and completes them with the digest and the counts.
    ///
    /// # Errors
    /// Another base epoch, malformed arrays, ids that should be held and are not or the other way round. The model is
    /// then unchanged.
    pub fn advance(&mut self, mut epoch: ModelEpoch) -> Result<ModelEpoch, ProtocolError> {
        if epoch.base_epoch != self.epoch {
            return Err(ProtocolError::WrongBase { held: self.epoch, base: epoch.base_epoch });
        }
        let changes = EpochChanges::unpack(&epoch, self.nodes.len())?;
        let nodes = changes.nodes_after(&self.nodes)?;
        self.surfels.digest_after(epoch.epoch, &changes.surfels())?;
        self.surfels.apply(epoch.epoch, &changes.surfels(), |record| *record);
        self.outdated = !self.surfels.is_empty() && (self.outdated || !changes.transforms.is_empty());
        (self.epoch, self.stamp_ns) = (epoch.epoch, epoch.stamp_ns);
        (self.nodes, self.node_reach_m) = (nodes, epoch.node_reach_m);
        epoch.digest = self.digest().value();
        (epoch.surfels, epoch.nodes) = (self.surfels.len() as u32, self.nodes.len() as u32);
        Ok(epoch)
    }

    /// Takes over the shapes that viewers hold at this epoch: all surfels, in any order.
    ///
    /// # Errors
    /// [`ProtocolError::NotHeld`] for one that viewers do not hold, [`ProtocolError::LengthMismatch`] where some lack,
    /// [`ProtocolError::Unpackable`].
    pub fn refresh(&mut self, surfels: &[WireSurfel]) -> Result<(), ProtocolError> {
        let expected = self.surfels.len();
        if surfels.len() != expected {
            return Err(ProtocolError::LengthMismatch {
                field: "held surfels",
                got: surfels.len(),
                expected,
            });
        }
        for surfel in surfels {
            let index = self.surfels.index_of(surfel.id);
            let index = index.ok_or(ProtocolError::NotHeld { what: "surfel", id: surfel.id })?;
            self.surfels.rows_mut()[index] = SurfelRecord::pack(surfel)?;
        }
        self.outdated = false;
        Ok(())
    }

    /// The changes that empty this model in the next epoch; for [`Self::advance`].
    ///
    /// # Errors
    /// None in practice: the ids are the model's own.
    pub fn clearing(&self) -> Result<ModelEpoch, ProtocolError> {
        Ok(ModelEpoch {
            epoch: self.epoch + 1,
            base_epoch: self.epoch,
            stamp_ns: self.stamp_ns,
            removed_ids: pack_ids(self.surfels.ids())?,
            removed_node_ids: pack_ids(self.nodes.ids())?,
            node_reach_m: self.node_reach_m,
            ..ModelEpoch::default()
        })
    }

    /// The part of the model whose surfels `wanted` picks by id and position; it has all nodes.
    ///
    /// # Errors
    /// None in practice: ids are the model's own.
    pub fn thinned(&self, wanted: impl Fn(u32, [f32; 3]) -> bool) -> Result<Self, ProtocolError> {
        let table = &self.surfels;
        let all = table.ids().iter().zip(table.versions()).zip(table.rows());
        let kept = all.filter(|((id, _), record)| wanted(**id, record.position_in_world_m()));
        let surfels = SurfelTable::collect(kept.map(|((id, version), row)| (*id, *version, *row)).collect())?;
        Ok(Self { surfels, nodes: self.nodes.clone(), ..*self })
    }
}
