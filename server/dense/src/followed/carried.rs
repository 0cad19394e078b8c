//! Points in the world that the warp carries along, and fusion with the surface.

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::snap_points;
use crate::index_map::IndexMap;
use crate::node_graph::{GraphSettings, NodeStore};
use crate::store::{Bits, Row, SurfelStore};
use crate::view::GpuView;
use crate::warp::{StirredCells, SurfelWarp, WarpParts};

/// The points, and what the warp of surfels wants to know of them.
#[derive(Debug)]
pub(crate) struct CarriedPoints {
    pub(super) settings: GpuBuffer<GraphSettings>,
    /// World, m; the fourth value is the owner's.
    pub rows: GpuBuffer<Row>,
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
    pub index_map: &'a IndexMap,
    pub surfels: &'a SurfelStore,
}

impl CarriedPoints {
    /// Room for so many; the first `settings.surfels` of them count.
    pub fn new(gpu: &Gpu, room: usize, settings: &GraphSettings) -> Result<Self, GpuError> {
        Ok(Self {
            settings: gpu.uniform("carried settings", settings)?,
            rows: gpu.storage("carried points", room)?,
            normals: gpu.storage_from("carried normals", &vec![[0.0, 0.0, 1.0, 0.0]; room])?,
            state: gpu.storage_from("carried state", &vec![[1; 4]; room])?,
        })
    }

    /// Sets how many count.
    pub fn set(&self, gpu: &Gpu, settings: GraphSettings) -> Result<(), GpuError> {
        gpu.write(&self.settings, 0, &[settings])
    }

    /// The passes for points that the warp of `nodes` moves where `stirred` is marked.
    pub fn bind(
        &self,
        gpu: &Gpu,
        (nodes, stirred): (&NodeStore, &StirredCells),
        shown: &Shown,
    ) -> Result<PointPasses, GpuError> {
        let parts = WarpParts {
            settings: &self.settings,
            rows: &nodes.rows,
            hash: &nodes.hash,
            transforms: &nodes.transforms,
            geometry: &self.rows,
            orientation: &self.normals,
            state: &self.state,
        };
        let snap = snap_points::bind(gpu, shown, &self.settings, &self.rows)?;
        Ok(PointPasses { warp: SurfelWarp::new(gpu, &parts, stirred)?, snap })
    }
}

impl PointPasses {
    /// Records the warp of the first points; the nodes must still be where they were.
    pub fn record_warp(&self, frame: &mut FrameRecorder, points: u32) -> Result<(), GpuError> {
        if points == 0 { Ok(()) } else { self.warp.record(frame, points) }
    }

    /// Records their way onto the fused surface.
    pub fn record_snap(&self, frame: &mut FrameRecorder, points: u32) -> Result<(), GpuError> {
        frame.stage("carried points", |stage| stage.run(&self.snap, [points, 1, 1]))
    }
}
