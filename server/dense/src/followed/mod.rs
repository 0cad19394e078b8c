//! Material points that the model carries along: the paper's measure of accuracy.
//!
//! A point goes where the warp takes it, and then onto the plane of the surfel that shows there: what fusion corrects of
//! the surface it corrects of the point, and the way along the surface is the warp's alone.

mod carried;
#[cfg(test)]
mod snap_oracle;
mod snap_points;

pub(crate) use carried::{CarriedPoints, PointPasses, Shown};

use gpu::{FrameRecorder, Gpu, GpuError, KernelDeclaration};
use nalgebra::Point3;

use crate::node_graph::{GraphSettings, NodeStore};
use crate::store::Row;
use crate::warp::StirredCells;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 1] = [snap_points::DECLARATION];

/// The most points; a recording's truth has a few thousand.
pub(crate) const POINTS_MAX: usize = 8192;

/// Points by the order in which they were taken up.
#[derive(Debug)]
pub(crate) struct FollowedPoints {
    ids: Vec<u32>,
    carried: CarriedPoints,
}

impl FollowedPoints {
    /// No points yet.
    pub fn new(gpu: &Gpu, settings: GraphSettings) -> Result<Self, GpuError> {
        let none = GraphSettings { surfels: 0, ..settings };
        Ok(Self { ids: Vec::new(), carried: CarriedPoints::new(gpu, POINTS_MAX, &none)? })
    }

    /// As [`CarriedPoints::bind`].
    pub fn bind(
        &self,
        gpu: &Gpu,
        warp: (&NodeStore, &StirredCells),
        shown: &Shown,
    ) -> Result<PointPasses, GpuError> {
        self.carried.bind(gpu, warp, shown)
    }

    /// Takes up points in the model's present shape, world coordinates, metres; those beyond the room are left out.
    pub fn add(
        &mut self,
        gpu: &Gpu,
        settings: GraphSettings,
        added: &[(u32, Point3<f64>)],
    ) -> Result<(), GpuError> {
        let added = &added[..added.len().min(POINTS_MAX - self.ids.len())];
        let row = |(_, point): &(u32, Point3<f64>)| [point.x as f32, point.y as f32, point.z as f32, 0.0];
        gpu.write(&self.carried.rows, self.ids.len(), &added.iter().map(row).collect::<Vec<Row>>())?;
        self.ids.extend(added.iter().map(|(id, _)| *id));
        self.carried.set(gpu, GraphSettings { surfels: self.ids.len() as u32, ..settings })
    }

    /// Records the warp of the points; the nodes must still be where they were.
    pub fn record_warp(&self, frame: &mut FrameRecorder, passes: &PointPasses) -> Result<(), GpuError> {
        passes.record_warp(frame, self.ids.len() as u32)
    }

    /// Records their way onto the fused surface.
    pub fn record_snap(&self, frame: &mut FrameRecorder, passes: &PointPasses) -> Result<(), GpuError> {
        passes.record_snap(frame, self.ids.len() as u32)
    }

    /// Where the points are now, in world, metres.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<(u32, Point3<f64>)>, GpuError> {
        let rows = gpu.read_range(&self.carried.rows, 0, self.ids.len())?;
        let point = |row: &Row| Point3::new(row[0], row[1], row[2]).map(f64::from);
        Ok(self.ids.iter().copied().zip(rows.iter().map(point)).collect())
    }
}
