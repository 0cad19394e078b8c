//! The nodes on the GPU.

use gpu::{FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::settings::{GraphSettings, NodeConfig};
use crate::store::{Bits, Row};

/// Place in [`NodeStore::state`].
pub(crate) const ALIVE_NODES: usize = 0;
/// Length of [`NodeStore::state`].
const STATE_LEN: usize = 8;
/// The most edges of a node: its 8 nearest, and 12 that count it among theirs.
pub(crate) const EDGES: usize = 20;
/// Nearest nodes that a node is joined to.
pub(crate) const NEAREST: usize = 8;
/// Followers that a node knows.
const FOLLOWERS: usize = 32;

/// A hash over the positions of nodes; see `shared/binding.wgsl`.
#[derive(Clone, Debug)]
pub(crate) struct NodeHash {
    pub heads: GpuBuffer<u32>,
    pub next: GpuBuffer<u32>,
}

impl NodeHash {
    /// For as many nodes as `config` has room for.
    pub fn new(gpu: &Gpu, config: &NodeConfig) -> Result<Self, GpuError> {
        Ok(Self {
            heads: gpu.storage("node heads", GraphSettings::table_places(config) as usize)?,
            next: gpu.storage("node next", config.capacity as usize)?,
        })
    }
}

/// All nodes of a session, by slot.
#[derive(Clone, Debug)]
pub(crate) struct NodeStore {
    pub settings: GpuBuffer<GraphSettings>,
    /// Bits of the position in world (m) in the model's present shape, id + 1 (0: free).
    pub rows: GpuBuffer<Bits>,
    /// The last frame's warp, three rows per node: a row of `A`, and of `t` (m).
    pub transforms: GpuBuffer<Row>,
    /// The warps since the last reset composed, in the same form: `A` and the way that the node has gone.
    pub travelled: GpuBuffer<Row>,
    /// Tick at which a surfel last held the node.
    pub held: GpuBuffer<u32>,
    /// Nodes alive, next id, nodes refused in the last frame, added, removed.
    pub state: GpuBuffer<u32>,
    /// [`NEAREST`] slots per node, those of free slots and missing ones `u32::MAX`.
    pub nearest: GpuBuffer<u32>,
    /// [`EDGES`] slots per node: the nearest and those whose nearest it is, then `u32::MAX`.
    pub edges: GpuBuffer<u32>,
    /// Nodes that count this one among their nearest.
    pub follower_counts: GpuBuffer<u32>,
    /// [`FOLLOWERS`] slots per node.
    pub followers: GpuBuffer<u32>,
    pub hash: NodeHash,
    /// Claims on the cells of the sampling grid.
    pub claims: GpuBuffer<u32>,
    /// Free slots, scratch of `place_nodes`.
    pub free: GpuBuffer<u32>,
    /// Per place of `claims`: slot + 1 of the surfel that becomes a node.
    pub chosen: GpuBuffer<u32>,
}

impl NodeStore {
    /// Room for the nodes of `config`; to be cleared before use.
    pub fn new(gpu: &Gpu, config: &NodeConfig) -> Result<Self, GpuError> {
        let (len, places) = (config.capacity as usize, GraphSettings::table_places(config) as usize);
        Ok(Self {
            settings: gpu.uniform("graph settings", &GraphSettings::new(config))?,
            rows: gpu.storage("nodes", len)?,
            transforms: gpu.storage("node transforms", 3 * len)?,
            travelled: gpu.storage("node travelled", 3 * len)?,
            held: gpu.storage("node held", len)?,
            state: gpu.storage("node state", STATE_LEN)?,
            nearest: gpu.storage("node nearest", NEAREST * len)?,
            edges: gpu.storage("node edges", EDGES * len)?,
            follower_counts: gpu.storage("node follower counts", len)?,
            followers: gpu.storage("node followers", FOLLOWERS * len)?,
            hash: NodeHash::new(gpu, config)?,
            claims: gpu.storage("node claims", places)?,
            free: gpu.storage("free nodes", len)?,
            chosen: gpu.storage("chosen nodes", places)?,
        })
    }

    /// Empties the graph.
    pub fn clear(&self, frame: &mut FrameRecorder) {
        frame.clear(&self.rows);
        frame.clear(&self.state);
        frame.clear(&self.transforms);
        frame.clear(&self.travelled);
        frame.clear(&self.hash.heads);
    }

    /// Slots there are.
    pub fn capacity(&self) -> u32 {
        self.rows.len() as u32
    }
}
