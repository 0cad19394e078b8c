//! Deformation nodes and their motion: whole numbers of fixed steps, so that all who follow hold the same bits.
//!
//! A node's transform moves a point `v` near it to `A (v - g) + g + t`, with `g` the node before the epoch; the node
//! itself moves to `g + t`. Layouts are those of SPEC.md.

use prost::bytes::Bytes;

use crate::limits::MAX_NODES;
use crate::packed::{elements, pack_ids, unpack_ids};
use crate::v1::PackedNodes;
use crate::{Digest, ProtocolError};

/// Step of node positions and of translations, metres: 4 micrometres.
pub const NODE_STEP_M: f64 = 4e-6;
/// Step of the elements of `A - I`.
pub const AFFINE_STEP: f64 = 1.0 / 4096.0;
/// Components of a transform: three of `t`, nine of `A - I` by rows.
pub const TRANSFORM_COMPONENTS: usize = 12;

const POSITION_BYTES: usize = 12;
const TRANSFORM_BYTES: usize = 2 * TRANSFORM_COMPONENTS;

/// A node's place in the world, in steps of [`NODE_STEP_M`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct NodePosition(pub [i32; 3]);

impl NodePosition {
    /// The nearest place; what no step reaches is clamped, what is no number goes to the origin.
    pub fn pack(position_in_world_m: [f32; 3]) -> Self {
        Self(position_in_world_m.map(|value| (f64::from(value) / NODE_STEP_M).round() as i32))
    }

    /// Metres in the world.
    pub fn unpack(self) -> [f32; 3] {
        self.0.map(|code| (f64::from(code) * NODE_STEP_M) as f32)
    }

    /// The place after a translation; wraps around far outside of any scene.
    #[must_use]
    pub fn moved(self, transform: &NodeTransform) -> Self {
        let [x, y, z, ..] = transform.0;
        let [px, py, pz] = self.0;
        Self([px.wrapping_add(x.into()), py.wrapping_add(y.into()), pz.wrapping_add(z.into())])
    }
}

/// A node's motion over one epoch: `t` in steps of [`NODE_STEP_M`], then `A - I` by rows in steps of [`AFFINE_STEP`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct NodeTransform(pub [i16; TRANSFORM_COMPONENTS]);

impl NodeTransform {
    /// `t` in metres.
    pub fn translation_m(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis| (f64::from(self.0[axis]) * NODE_STEP_M) as f32)
    }

    /// `A` by rows.
    pub fn affine(&self) -> [[f32; 3]; 3] {
        let element = |row: usize, column: usize| {
            let identity = f64::from(u8::from(row == column));
            (identity + f64::from(self.0[3 + 3 * row + column]) * AFFINE_STEP) as f32
        };
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| element(row, column)))
    }
}

/// Packs transforms in the order of the nodes' ids. Per component a plane of low and a plane of high bytes, the sign
/// folded into the lowest bit (zigzag): small motions leave the high planes zero, which compresses to nothing.
pub fn pack_transforms(transforms: &[NodeTransform]) -> Bytes {
    let mut planes = Vec::with_capacity(transforms.len() * TRANSFORM_BYTES);
    for component in 0..TRANSFORM_COMPONENTS {
        let zigzag = |transform: &NodeTransform| {
            let code = transform.0[component];
            ((code << 1) ^ (code >> 15)) as u16
        };
        planes.extend(transforms.iter().map(|transform| zigzag(transform) as u8));
        planes.extend(transforms.iter().map(|transform| (zigzag(transform) >> 8) as u8));
    }
    planes.into()
}

/// Reads the transforms of `nodes` nodes.
///
/// # Errors
/// Ragged, or not as many as the nodes.
pub fn unpack_transforms(bytes: &[u8], nodes: usize) -> Result<Vec<NodeTransform>, ProtocolError> {
    let planes = elements("node_transforms", bytes, TRANSFORM_BYTES, nodes)?;
    let component = |node: usize, component: usize| {
        let byte = |plane: usize| u16::from(planes[plane * nodes + node]);
        let folded = byte(2 * component) | byte(2 * component + 1) << 8;
        (folded >> 1) as i16 ^ -((folded & 1) as i16)
    };
    Ok((0..nodes).map(|node| NodeTransform(std::array::from_fn(|place| component(node, place)))).collect())
}

/// Packs nodes, which must come by increasing id: x, y, z as i32 little-endian each.
///
/// # Errors
/// [`ProtocolError::UnsortedIds`].
pub fn pack_nodes(ids: &[u32], positions: &[NodePosition]) -> Result<PackedNodes, ProtocolError> {
    let positions = positions.iter().flat_map(|position| position.0).flat_map(i32::to_le_bytes).collect();
    Ok(PackedNodes { ids: pack_ids(ids)?, positions })
}

/// Checks and reads nodes.
///
/// # Errors
/// As [`unpack_ids`], more than [`MAX_NODES`], or not as many positions as ids.
pub fn unpack_nodes(packed: &PackedNodes) -> Result<Vec<(u32, NodePosition)>, ProtocolError> {
    let ids = unpack_ids("node ids", &packed.ids)?;
    expect_few(ids.len())?;
    let bytes = elements("node positions", &packed.positions, POSITION_BYTES, ids.len())?;
    let (codes, _) = bytes.as_chunks::<4>();
    let position =
        |index: usize| NodePosition(std::array::from_fn(|axis| i32::from_le_bytes(codes[3 * index + axis])));
    Ok(ids.iter().enumerate().map(|(index, &id)| (id, position(index))).collect())
}

fn expect_few(nodes: usize) -> Result<(), ProtocolError> {
    if nodes <= MAX_NODES {
        Ok(())
    } else {
        Err(ProtocolError::TooMany { field: "nodes", got: nodes, limit: MAX_NODES })
    }
}

/// The node graph that viewers hold.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct NodeTable {
    ids: Vec<u32>,
    positions: Vec<NodePosition>,
}

impl NodeTable {
    /// Nodes held.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there are none: then nothing deforms.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Ids, increasing.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Places, in the order of the ids.
    pub fn positions(&self) -> &[NodePosition] {
        &self.positions
    }

    /// The nodes of a snapshot.
    pub fn from_sorted(nodes: Vec<(u32, NodePosition)>) -> Self {
        let (ids, positions) = nodes.into_iter().unzip();
        Self { ids, positions }
    }

    /// Moves all nodes (no transforms: none moves), then takes away and adds.
    ///
    /// # Errors
    /// A removed node that is not held, an added one that is, more than [`MAX_NODES`].
    pub fn after(
        &self,
        transforms: &[NodeTransform],
        removed: &[u32],
        added: &[(u32, NodePosition)],
    ) -> Result<Self, ProtocolError> {
        let mut nodes: Vec<(u32, NodePosition)> =
            self.ids.iter().copied().zip(self.positions.iter().copied()).collect();
        for ((_, position), transform) in nodes.iter_mut().zip(transforms) {
            *position = position.moved(transform);
        }
        if let Some(&id) = removed.iter().find(|id| self.ids.binary_search(id).is_err()) {
            return Err(ProtocolError::NotHeld { what: "node", id });
        }
        nodes.retain(|(id, _)| removed.binary_search(id).is_err());
        if let Some(&(id, _)) = added.iter().find(|(id, _)| nodes.binary_search_by_key(id, |n| n.0).is_ok()) {
            return Err(ProtocolError::AlreadyHeld { what: "node", id });
        }
        expect_few(nodes.len() + added.len())?;
        nodes.extend_from_slice(added);
        nodes.sort_unstable_by_key(|(id, _)| *id);
        Ok(Self::from_sorted(nodes))
    }

    /// The nodes' part of a model's digest.
    pub fn digest(&self) -> Digest {
        let mut digest = Digest::default();
        for (&id, position) in self.ids.iter().zip(&self.positions) {
            digest.insert_node(id, *position);
        }
        digest
    }
}
