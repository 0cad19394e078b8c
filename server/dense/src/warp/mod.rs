//! Applies the warp of one frame: surfels and nodes go from the shape of frame n-1 to that of frame n.
//!
//! Which nodes move a surfel is found anew in every frame by the rule of [`crate::node_graph`], so nothing is kept per
//! surfel. Only where the warp is not the identity are surfels read at all: time does not grow with the unseen model.

mod move_nodes;
#[cfg(test)]
mod move_oracle;
mod move_surfels;
mod stir_cells;

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::node_graph::{GraphSettings, NodeHash};
use crate::store::{Bits, Row};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 3] =
    [stir_cells::DECLARATION, move_surfels::DECLARATION, move_nodes::DECLARATION];

/// What a warp moves and by what. The hash must be recorded for `rows`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WarpParts<'a> {
    pub settings: &'a GpuBuffer<GraphSettings>,
    /// Nodes in the shape before the warp.
    pub rows: &'a GpuBuffer<Bits>,
    pub hash: &'a NodeHash,
    /// The warp, as [`crate::node_graph::NodeStore::transforms`].
    pub transforms: &'a GpuBuffer<Row>,
    /// Positions to move.
    pub geometry: &'a GpuBuffer<Row>,
    /// Normals to turn.
    pub orientation: &'a GpuBuffer<Row>,
    /// Rows whose `w` is 0 where a slot is not to be moved.
    pub state: &'a GpuBuffer<Bits>,
}

/// The cells that a warp reaches, marked once for all that it moves.
#[derive(Debug)]
pub(crate) struct StirredCells {
    stir: BoundKernel,
    /// 1 where a bucket of the hash has such a cell.
    marks: GpuBuffer<u32>,
    node_slots: u32,
}

impl StirredCells {
    /// For the nodes and the warp of `parts`.
    pub fn new(gpu: &Gpu, parts: &WarpParts) -> Result<Self, GpuError> {
        let marks = gpu.storage("stirred cells", parts.hash.heads.len())?;
        Ok(Self { stir: stir_cells::bind(gpu, parts, &marks)?, marks, node_slots: parts.rows.len() as u32 })
    }

    /// Records the marks, before whatever is moved by this warp: 1 dispatch.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.clear(&self.marks);
        frame.stage("warp", |stage| stage.run(&self.stir, [self.node_slots, 1, 1]))
    }
}

/// The warp of surfels, bound to its parts.
#[derive(Debug)]
pub(crate) struct SurfelWarp {
    surfels: BoundKernel,
}

impl SurfelWarp {
    /// Moves what `parts` name where `stirred`, of the same nodes and warp, is marked.
    pub fn new(gpu: &Gpu, parts: &WarpParts, stirred: &StirredCells) -> Result<Self, GpuError> {
        Ok(Self { surfels: move_surfels::bind(gpu, parts, &stirred.marks)? })
    }

    /// Records the movement of the first `slots` surfels: 1 dispatch. The nodes stay where they are.
    pub fn record(&self, frame: &mut FrameRecorder, slots: u32) -> Result<(), GpuError> {
        frame.stage("warp", |stage| stage.run(&self.surfels, [slots, 1, 1]))
    }
}

/// The movement of the nodes themselves, after the surfels'.
#[derive(Debug)]
pub(crate) struct NodeWarp {
    nodes: BoundKernel,
    slots: u32,
}

impl NodeWarp {
    /// Moves `rows` by `transforms` and adds them to `travelled`.
    pub fn new(
        gpu: &Gpu,
        rows: &GpuBuffer<Bits>,
        transforms: &GpuBuffer<Row>,
        travelled: &GpuBuffer<Row>,
    ) -> Result<Self, GpuError> {
        Ok(Self { nodes: move_nodes::bind(gpu, rows, transforms, travelled)?, slots: rows.len() as u32 })
    }

    /// Records it: 1 dispatch.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.stage("warp", |stage| stage.run(&self.nodes, [self.slots, 1, 1]))
    }
}
