//! Material points that the model carries along: the paper's measure of accuracy.
//!
//! A point goes where the warp takes it, and then onto the plane of the surfel that shows there: what fusion corrects of
//! the surface it corrects of the point, and the way along the surface is the warp's alone.

#[cfg(test)]
mod snap_oracle;
mod snap_points;

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError, KernelDeclaration};
use nalgebra::Point3;

use crate::node_graph::{GraphSettings, NodeStore};
use crate::store::{Bits, Row, SurfelStore};
use crate::view::GpuView;
use crate::warp::{SurfelWarp, WarpParts};

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 1] = [snap_points::DECLARATION];

/// The most points; a recording's truth has a few thousand.
pub(crate) const POINTS_MAX: usize = 8192;

/// Points by the order in which they were taken up, and the buffers that carry them.
#[derive(Debug)]
pub(crate) struct FollowedPoints {
    ids: Vec<u32>,
    settings: GpuBuffer<GraphSettings>,
    pub points: GpuBuffer<Row>,
    normals: GpuBuffer<Row>,
    state: GpuBuffer<Bits>,
}

/// The passes that move the points, bound to the present arrays.
#[derive(Debug)]
pub(crate) struct PointPasses {
    warp: SurfelWarp,
    snap: BoundKernel,
}

/// What shows the model's surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shown<'a> {
    pub view: &'a GpuBuffer<GpuView>,
    pub index_scale: &'a GpuBuffer<u32>,
    /// As `IndexMap::slots`.
    pub slots: &'a GpuBuffer<u32>,
    pub surfels: &'a SurfelStore,
}

impl FollowedPoints {
    /// No points yet.
    pub fn new(gpu: &Gpu, settings: GraphSettings) -> Result<Self, GpuError> {
        let none = GraphSettings { surfels: 0, ..settings };
        Ok(Self {
            ids: Vec::new(),
            settings: gpu.uniform("followed settings", &none)?,
            points: gpu.storage("followed points", POINTS_MAX)?,
            normals: gpu.storage_from("followed normals", &vec![[0.0, 0.0, 1.0, 0.0]; POINTS_MAX])?,
            state: gpu.storage_from("followed state", &vec![[1; 4]; POINTS_MAX])?,
        })
    }

    pub fn bind(&self, gpu: &Gpu, nodes: &NodeStore, shown: &Shown) -> Result<PointPasses, GpuError> {
        let parts = WarpParts {
            settings: &self.settings,
            rows: &nodes.rows,
            hash: &nodes.hash,
            transforms: &nodes.transforms,
            geometry: &self.points,
            orientation: &self.normals,
            state: &self.state,
        };
        let snap = snap_points::bind(gpu, shown, &self.settings, &self.points)?;
        Ok(PointPasses { warp: SurfelWarp::new(gpu, &parts)?, snap })
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
        gpu.write(&self.points, self.ids.len(), &added.iter().map(row).collect::<Vec<Row>>())?;
        self.ids.extend(added.iter().map(|(id, _)| *id));
        gpu.write(&self.settings, 0, &[GraphSettings { surfels: self.ids.len() as u32, ..settings }])
    }

    /// Records the warp of the points; the nodes must still be where they were.
    pub fn record_warp(&self, frame: &mut FrameRecorder, passes: &PointPasses) -> Result<(), GpuError> {
        if self.ids.is_empty() { Ok(()) } else { passes.warp.record(frame, self.ids.len() as u32) }
    }

    /// Records their way onto the fused surface.
    pub fn record_snap(&self, frame: &mut FrameRecorder, passes: &PointPasses) -> Result<(), GpuError> {
        let count = self.ids.len() as u32;
        frame.stage("followed points", |stage| stage.run(&passes.snap, [count, 1, 1]))
    }

    /// Where the points are now, in world, metres.
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<(u32, Point3<f64>)>, GpuError> {
        let rows = gpu.read_range(&self.points, 0, self.ids.len())?;
        let point = |row: &Row| Point3::new(row[0], row[1], row[2]).map(f64::from);
        Ok(self.ids.iter().copied().zip(rows.iter().map(point)).collect())
    }
}
