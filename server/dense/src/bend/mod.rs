//! Bends the model when the tracker has corrected its map: what was last seen in a frame goes with the world of that frame
//! (the loop closure that the paper leaves to the future). The graph's own rule joins what was seen at different times, so
//! nothing tears, and viewers hear of it as of any other warp.

mod bend_nodes;
#[cfg(test)]
mod bend_oracle;
mod date_nodes;

use geometry::Pose;
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use crate::node_graph::NodeStore;
use crate::store::{Row, SurfelStore};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 2] = [date_nodes::DECLARATION, bend_nodes::DECLARATION];

/// The most corrections taken over at once; of more, some evenly spread.
const CORRECTIONS_MAX: usize = 2048;

/// How the world has moved for what was last seen in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameCorrection {
    /// Index of the frame.
    pub frame: u32,
    /// Takes points where they were to where they are.
    pub after_from_before: Pose,
}

/// Corrections on the GPU.
#[derive(Clone, Debug)]
pub(crate) struct Corrections {
    count: GpuBuffer<u32>,
    rows: GpuBuffer<Row>,
}

impl Corrections {
    pub fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        Ok(Self {
            count: gpu.uniform("corrections", &1u32)?,
            rows: gpu.storage("correction rows", 2 * CORRECTIONS_MAX)?,
        })
    }

    /// Takes over corrections of ascending frames; at least one.
    pub fn write(&self, gpu: &Gpu, corrections: &[FrameCorrection]) -> Result<(), GpuError> {
        let kept = thinned(corrections, CORRECTIONS_MAX);
        let rows: Vec<Row> = kept.iter().flat_map(rows_of).collect();
        gpu.write(&self.rows, 0, &rows)?;
        gpu.write(&self.count, 0, &[kept.len() as u32])
    }
}

fn rows_of(correction: &FrameCorrection) -> [Row; 2] {
    let pose = &correction.after_from_before;
    let [x, y, z] = [0, 1, 2].map(|axis| pose.translation.vector[axis] as f32);
    let turn = pose.rotation.coords;
    [[0, 1, 2, 3].map(|part| turn[part] as f32), [x, y, z, f32::from_bits(correction.frame)]]
}

/// At most so many, evenly spread, the last among them.
fn thinned(corrections: &[FrameCorrection], most: usize) -> Vec<FrameCorrection> {
    let step = corrections.len().div_ceil(most).max(1);
    let mut kept: Vec<_> = corrections.iter().rev().step_by(step).copied().collect();
    kept.reverse();
    kept
}

/// The passes that find the bend, bound to a surfel store.
#[derive(Debug)]
pub(crate) struct Bend {
    dates: GpuBuffer<u32>,
    date: BoundKernel,
    bend: BoundKernel,
    node_slots: u32,
}

impl Bend {
    pub fn new(
        gpu: &Gpu,
        nodes: &NodeStore,
        surfels: &SurfelStore,
        corrections: &Corrections,
    ) -> Result<Self, GpuError> {
        let dates = gpu.storage("node dates", nodes.rows.len())?;
        Ok(Self {
            date: date_nodes::bind(gpu, nodes, surfels, &dates)?,
            bend: bend_nodes::bind(gpu, nodes, &dates, corrections)?,
            node_slots: nodes.capacity(),
            dates,
        })
    }

    /// Records it, with the hash and the nearest nodes in the model's present shape: 2 dispatches, to be followed by
    /// those that move what the nodes carry.
    pub fn record(&self, frame: &mut FrameRecorder, surfel_slots: u32) -> Result<(), GpuError> {
        frame.clear(&self.dates);
        frame.stage("bend", |stage| {
            stage.run(&self.date, [surfel_slots, 1, 1])?;
            stage.run(&self.bend, [self.node_slots, 1, 1])
        })
    }
}
