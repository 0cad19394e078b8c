//! What a reconstruction says about its model, made into changes of what viewers hold.

use protocol::v1::ModelEpoch;
use protocol::{
    Bytes, NodePosition, NodeTransform, PackedModel, ProtocolError, SurfelRecord, WireSurfel, pack_ids,
    pack_nodes, pack_surfels, pack_transforms,
};

/// What a session's model did since the last one.
#[derive(Clone, Debug, Default)]
pub struct ModelUpdate {
    /// Stamp of the newest pair in it.
    pub stamp_ns: u64,
    /// Added and changed surfels, by increasing id.
    pub changed: Vec<WireSurfel>,
    /// Removed ids, increasing.
    pub removed: Vec<u32>,
    /// The warp.
    pub nodes: NodeChanges,
    /// How far what viewers hold is then from the model, at most, metres.
    pub max_error_m: f32,
}

/// The motion of what viewers hold, and how its nodes come and go.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeChanges {
    /// Of every node held, by increasing id; empty where nothing deforms.
    pub transforms: Vec<NodeTransform>,
    /// Ids that go after that, increasing.
    pub removed: Vec<u32>,
    /// Nodes that come after that, by increasing id.
    pub added: Vec<(u32, NodePosition)>,
    /// Reach of a node, metres.
    pub reach_m: f32,
}

impl ModelUpdate {
    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        let nodes = &self.nodes;
        let still = nodes.transforms.is_empty() && nodes.removed.is_empty() && nodes.added.is_empty();
        still && self.changed.is_empty() && self.removed.is_empty()
    }
}

/// What became of an update.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Published {
    /// The epoch that it became.
    pub epoch: u32,
    /// Surfels that viewers then hold.
    pub surfels: usize,
    /// What is sent to each viewer.
    pub message: Bytes,
    /// Surfels left out because they have no packed form.
    pub unpackable: usize,
}

/// The update as changes of what viewers hold, and how many surfels have no packed form.
///
/// Whether a surfel is added or updated is decided by what is held: a surfel that had no packed form yet, or has none
/// any more, is then neither forgotten nor left behind.
pub(super) fn reconcile(
    held: &PackedModel,
    update: &ModelUpdate,
) -> Result<(ModelEpoch, usize), ProtocolError> {
    let holds = |id: u32| held.surfels().index_of(id).is_some();
    let packable = |surfel: &WireSurfel| SurfelRecord::pack(surfel).is_ok();
    let (packable, unpackable): (Vec<WireSurfel>, Vec<WireSurfel>) =
        update.changed.iter().copied().partition(packable);
    let (updated, added): (Vec<_>, Vec<_>) = packable.into_iter().partition(|surfel| holds(surfel.id));
    let is_changed = |id: u32| updated.binary_search_by_key(&id, |surfel| surfel.id).is_ok();
    let gone = update.removed.iter().copied().chain(unpackable.iter().map(|surfel| surfel.id));
    let mut removed: Vec<u32> = gone.filter(|&id| holds(id) && !is_changed(id)).collect();
    removed.sort_unstable();
    removed.dedup();
    let nodes = &update.nodes;
    let (node_ids, node_places): (Vec<u32>, Vec<NodePosition>) = nodes.added.iter().copied().unzip();
    let changes = ModelEpoch {
        epoch: held.epoch() + 1,
        base_epoch: held.epoch(),
        stamp_ns: update.stamp_ns,
        node_transforms: pack_transforms(&nodes.transforms),
        removed_node_ids: pack_ids(&nodes.removed)?,
        added_nodes: Some(pack_nodes(&node_ids, &node_places)?),
        node_reach_m: nodes.reach_m,
        removed_ids: pack_ids(&removed)?,
        added: Some(pack_surfels(&added)?),
        updated: Some(pack_surfels(&updated)?),
        max_error_m: update.max_error_m,
        ..ModelEpoch::default()
    };
    Ok((changes, unpackable.len()))
}
