//! The graph of embedded deformation nodes that carries the warp (paper section "Deformation").
//!
//! # Which nodes move a point
//!
//! Server and viewers find this by themselves from the positions of the nodes in the shape that the point belongs to, so
//! it is never sent. All numbers are `f32`, in metres.
//!
//! 1. `reach = 2 x node spacing`. A node at squared distance `d2 = dx*dx + dy*dy + dz*dz` (summed in this order) is a
//!    candidate where `d2 < reach*reach`.
//! 2. Candidates are ordered by `d2`, ties by the lower id. The first four move the point (all, where there are fewer).
//! 3. `d_max = 1.001 * outer + 1e-6`, where `outer` is the distance to the fifth candidate, or `reach` where there are
//!    fewer than five.
//! 4. `w_j = 1 - d_j / d_max`, divided by the sum of these (Eq. `eq_weight`, which leaves the division out).
//! 5. A point without any candidate does not move.
//!
//! Weights are continuous (to 0.1 %) where the fourth and fifth node swap and where a node comes into reach: the one
//! that comes or goes has no weight. So it does not matter that two implementations may round a tie differently.
//!
//! # Life of a node
//!
//! Nodes are sampled on a grid as wide as the spacing, where a surfel seen in this frame has no node within the spacing.
//! A node nearest to no surfel for 64 frames is removed. Ids ascend and are never used again; slots are.

#[cfg(test)]
mod binding_oracle;
mod claim_nodes;
#[cfg(test)]
mod growth_tests;
mod hash_nodes;
mod join_edges;
mod link_nodes;
#[cfg(test)]
mod link_oracle;
mod place_nodes;
mod settings;
mod store;
mod thin_nodes;

#[cfg(test)]
pub(crate) use binding_oracle::{OracleNode, bind};
pub(crate) use settings::GraphSettings;
pub use settings::NodeConfig;
pub(crate) use store::{ALIVE_NODES, EDGES, NodeHash, NodeStore};

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::store::SurfelStore;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 6] = [
    hash_nodes::DECLARATION,
    claim_nodes::DECLARATION,
    thin_nodes::DECLARATION,
    place_nodes::DECLARATION,
    link_nodes::DECLARATION,
    join_edges::DECLARATION,
];

/// Finds nodes near points: a hash over the positions in `rows`, to be recorded anew when they have moved.
#[derive(Debug)]
pub(crate) struct NodeFinder {
    hash: BoundKernel,
    heads: GpuBuffer<u32>,
    slots: u32,
}

impl NodeFinder {
    /// Over `rows` (as [`NodeStore::rows`]) into `hash`.
    pub fn new(
        gpu: &Gpu,
        settings: &GpuBuffer<GraphSettings>,
        rows: &GpuBuffer<[u32; 4]>,
        hash: &NodeHash,
    ) -> Result<Self, GpuError> {
        Ok(Self {
            hash: hash_nodes::bind(gpu, settings, rows, hash)?,
            heads: hash.heads.clone(),
            slots: rows.len() as u32,
        })
    }

    /// Records the hash; 1 dispatch.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.clear(&self.heads);
        frame.stage("node graph", |stage| stage.run(&self.hash, [self.slots, 1, 1]))
    }
}

/// The passes that keep the graph, bound to a surfel store.
#[derive(Debug)]
pub(crate) struct NodeGraph {
    pub finder: NodeFinder,
    claim: BoundKernel,
    thin: BoundKernel,
    place: BoundKernel,
    link: BoundKernel,
    join: BoundKernel,
    nodes: NodeStore,
}

impl NodeGraph {
    pub fn new(gpu: &Gpu, nodes: &NodeStore, surfels: &SurfelStore) -> Result<Self, GpuError> {
        Ok(Self {
            finder: NodeFinder::new(gpu, &nodes.settings, &nodes.rows, &nodes.hash)?,
            claim: claim_nodes::bind(gpu, nodes, surfels)?,
            thin: thin_nodes::bind(gpu, nodes, surfels)?,
            place: place_nodes::bind(gpu, nodes, surfels)?,
            link: link_nodes::bind(gpu, nodes)?,
            join: join_edges::bind(gpu, nodes)?,
            nodes: nodes.clone(),
        })
    }

    /// Records growth, removal and edges at the end of a frame, with nodes and surfels in its shape: 7 dispatches.
    pub fn record(&self, frame: &mut FrameRecorder, surfel_slots: u32) -> Result<(), GpuError> {
        let (slots, places) = (self.nodes.capacity(), self.nodes.claims.len() as u32);
        self.finder.record(frame)?;
        frame.clear(&self.nodes.claims);
        frame.stage("node graph", |stage| {
            stage.run(&self.claim, [surfel_slots, 1, 1])?;
            stage.run(&self.thin, [places, 1, 1])?;
            stage.run(&self.place, [1, 1, 1])
        })?;
        self.finder.record(frame)?;
        frame.clear(&self.nodes.follower_counts);
        frame.stage("node graph", |stage| {
            stage.run(&self.link, [slots, 1, 1])?;
            stage.run(&self.join, [slots, 1, 1])
        })
    }
}
