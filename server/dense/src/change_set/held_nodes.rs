//! The nodes that viewers hold: on the GPU in the slots of the model's own, and which of them on the CPU.

use gpu::{FrameRecorder, Gpu, GpuBuffer, GpuError};

use crate::node_graph::{NodeConfig, NodeHash};
use crate::store::{Bits, Row};

/// Codes of a node's warp: t in node steps, then A - I by rows in affine steps.
pub type TransformCodes = [i16; 12];
/// A node's place in node steps.
pub type NodePlace = [i32; 3];

/// Words of two codes that a node's warp takes.
const WORDS: usize = 6;

/// Buffers by node slot.
#[derive(Clone, Debug)]
pub(crate) struct HeldNodes {
    /// Place in steps, id + 1 (0: none).
    pub places: GpuBuffer<[i32; 4]>,
    /// The same as rows of the node graph.
    pub rows: GpuBuffer<Bits>,
    pub hash: NodeHash,
    /// [`WORDS`] words per node.
    pub codes: GpuBuffer<u32>,
    /// What the codes decode to.
    pub transforms: GpuBuffer<Row>,
    /// Id + 1 by slot, as of the last epoch.
    held: Vec<u32>,
}

/// How the nodes that viewers hold moved, went and came; each list sorted by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WarpChanges {
    /// Of every node held, by increasing id; empty where none moves.
    pub transforms: Vec<TransformCodes>,
    /// Nodes that go after that.
    pub removed: Vec<u32>,
    /// Nodes that come after that.
    pub added: Vec<(u32, NodePlace)>,
    /// Reach of a node, metres.
    pub reach_m: f32,
}

impl HeldNodes {
    /// Room for the nodes of `config`; to be cleared before use.
    pub fn new(gpu: &Gpu, config: &NodeConfig) -> Result<Self, GpuError> {
        let len = config.capacity as usize;
        Ok(Self {
            places: gpu.storage("held node places", len)?,
            rows: gpu.storage("held nodes", len)?,
            hash: NodeHash::new(gpu, config)?,
            codes: gpu.storage("node codes", WORDS * len)?,
            transforms: gpu.storage("held node transforms", 3 * len)?,
            held: vec![0; len],
        })
    }

    /// Nothing is held.
    pub fn clear(&self, frame: &mut FrameRecorder) {
        frame.clear(&self.places);
        frame.clear(&self.rows);
        frame.clear(&self.transforms);
    }

    /// What the epoch just recorded says of the nodes.
    pub fn take(&mut self, gpu: &Gpu, reach_m: f32) -> Result<WarpChanges, GpuError> {
        let places = gpu.read(&self.places)?;
        let codes = gpu.read(&self.codes)?;
        let mut moved: Vec<(u32, TransformCodes)> = Vec::new();
        let mut changes = WarpChanges { reach_m, ..WarpChanges::default() };
        for (slot, &[x, y, z, tag]) in places.iter().enumerate() {
            let (before, after) = (self.held[slot], tag as u32);
            if before != 0 {
                moved.push((before - 1, unpack(&codes[WORDS * slot..][..WORDS])));
            }
            if before != after {
                changes.removed.extend(before.checked_sub(1));
                changes.added.extend(after.checked_sub(1).map(|id| (id, [x, y, z])));
            }
            self.held[slot] = after;
        }
        if moved.iter().any(|(_, codes)| *codes != TransformCodes::default()) {
            moved.sort_unstable_by_key(|(id, _)| *id);
            changes.transforms = moved.into_iter().map(|(_, codes)| codes).collect();
        }
        changes.removed.sort_unstable();
        changes.added.sort_unstable_by_key(|(id, _)| *id);
        Ok(changes)
    }
}

impl WarpChanges {
    /// Whether nodes stay where they are.
    pub fn is_empty(&self) -> bool {
        self.transforms.is_empty() && self.removed.is_empty() && self.added.is_empty()
    }
}

fn unpack(words: &[u32]) -> TransformCodes {
    std::array::from_fn(|place| (words[place / 2] >> (16 * (place % 2))) as i16)
}
