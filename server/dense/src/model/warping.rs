//! The deformation of the model within a frame: what outlives the surfel arrays, and what is bound to them.

use geometry::Pose;
use gpu::{FrameRecorder, Gpu, GpuError, Readback};
use nalgebra::Point3;

use super::FrameBuffers;
use crate::bend::{Bend, Corrections};
use crate::flow::{FlowParts, Keyframe, PatchFlow};
use crate::followed::{FollowedPoints, PointPasses, Shown};
use crate::node_graph::{ALIVE_NODES, GraphSettings, NodeGraph, NodeStore};
use crate::slam::Correspondence;
use crate::store::{Bits, Row};
use crate::view::GpuView;
use crate::warp::{NodeWarp, StirredCells, SurfelWarp, WarpParts};
use crate::warp_solver::{
    FrameBefore, Solve, SolverBuffers, SolverParts, SolverSettings, SolverState, WarpSolver,
};
use crate::{DenseConfig, FrameCorrection, Observation, View};

/// Nodes that a frame may solve beyond twice those of the last one.
const ROOM_TO_SPARE: u32 = 256;

/// What one frame's deformation was.
#[derive(Clone, Debug, PartialEq)]
pub struct WarpReport {
    /// Deformation nodes after the frame.
    pub nodes: u32,
    /// Nodes solved: those and their neighbours.
    pub solved: u32,
    /// Steps taken.
    pub steps: u32,
    /// Share of the energy that the first associations had and the last estimate kept.
    pub energy_left: f64,
    /// The tracker's pose, corrected by the solve.
    pub world_from_camera: Pose,
}

/// A deformation node, in the model's present shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Unique in the session, never used again.
    pub id: u32,
    /// In the world, metres.
    pub position: Point3<f64>,
}

/// Nodes, solver memory and what is kept of the last frame.
#[derive(Debug)]
pub(super) struct Warping {
    config: DenseConfig,
    nodes: NodeStore,
    before: FrameBefore,
    corrections: Corrections,
    keyframe: Keyframe,
    solver: SolverBuffers,
    node_state: Readback<u32>,
    solver_state: Readback<SolverState>,
    refined: Readback<GpuView>,
    followed: FollowedPoints,
    matches: u32,
    last_solved: u32,
}

/// What is known of the time since the frame before.
#[derive(Clone, Copy, Debug)]
pub(super) struct SinceLast {
    /// Whether that frame was fused.
    pub continues: bool,
    /// Whether the camera stayed where it was.
    pub at_rest: bool,
}

/// The deformation bound to the present surfel arrays.
#[derive(Debug)]
pub(super) struct BoundWarp {
    bend: Bend,
    graph: NodeGraph,
    stirred: StirredCells,
    surfels: SurfelWarp,
    nodes: NodeWarp,
    points: PointPasses,
    patches: PointPasses,
    flow: PatchFlow,
    solver: WarpSolver,
}

impl Warping {
    /// Room for the nodes of `config`; to be cleared before use.
    pub fn new(gpu: &Gpu, observation: &Observation, config: &DenseConfig) -> Result<Self, GpuError> {
        let size = (observation.width, observation.height);
        let settings = SolverSettings::new(&config.warp, size);
        let nodes = NodeStore::new(gpu, &config.nodes)?;
        let keyframe = Keyframe::new(gpu, observation, config)?;
        let before = FrameBefore::new(gpu, observation, keyframe.patches, &config.warp)?;
        let room = (nodes.capacity() as usize, before.matches.len());
        let solver = SolverBuffers::new(gpu, &settings, &config.warp, room)?;
        Ok(Self {
            before,
            corrections: Corrections::new(gpu)?,
            node_state: Readback::new(gpu, "node state read", nodes.state.len())?,
            solver_state: Readback::new(gpu, "solver state read", 1)?,
            refined: Readback::new(gpu, "refined view read", 1)?,
            followed: FollowedPoints::new(gpu, GraphSettings::new(&config.nodes))?,
            config: config.clone(),
            nodes,
            keyframe,
            solver,
            matches: 0,
            last_solved: 0,
        })
    }

    /// Knows of no node and no frame.
    pub fn clear(&self, frame: &mut FrameRecorder) {
        self.nodes.clear(frame);
        self.before.clear(frame);
        frame.clear(&self.solver.state);
        frame.clear(&self.solver.refined);
    }

    pub fn bind(&self, gpu: &Gpu, buffers: &FrameBuffers) -> Result<BoundWarp, GpuError> {
        let (nodes, surfels) = (&self.nodes, &buffers.store);
        let parts = WarpParts {
            settings: &nodes.settings,
            rows: &nodes.rows,
            hash: &nodes.hash,
            transforms: &nodes.transforms,
            geometry: &surfels.geometry,
            orientation: &surfels.orientation,
            state: &surfels.history,
        };
        let solver = SolverParts {
            view: &buffers.view,
            index_scale: &buffers.index_scale,
            index_map: &buffers.index_map,
            observation: &buffers.observation,
            surfels,
            nodes,
            before: &self.before,
            tissue: &self.keyframe.tissue.rows,
            results: &buffers.results,
        };
        let flow = FlowParts {
            view: &buffers.view,
            refined: &self.solver.refined,
            observation: &buffers.observation,
            keyframe: &self.keyframe,
            matches: &self.before.matches,
        };
        let shown = Shown {
            view: &buffers.view,
            index_scale: &buffers.index_scale,
            index_map: &buffers.index_map,
            surfels,
        };
        let stirred = StirredCells::new(gpu, &parts)?;
        Ok(BoundWarp {
            bend: Bend::new(gpu, nodes, surfels, &self.corrections)?,
            points: self.followed.bind(gpu, (nodes, &stirred), &shown)?,
            patches: self.keyframe.tissue.bind(gpu, (nodes, &stirred), &shown)?,
            graph: NodeGraph::new(gpu, nodes, surfels)?,
            surfels: SurfelWarp::new(gpu, &parts, &stirred)?,
            stirred,
            nodes: NodeWarp::new(gpu, &nodes.rows, &nodes.transforms, &nodes.travelled)?,
            flow: PatchFlow::new(gpu, &self.config.flow, &flow)?,
            solver: WarpSolver::new(gpu, &solver, &self.solver, &self.config.warp)?,
        })
    }

    /// The nodes themselves.
    pub fn store(&self) -> &NodeStore {
        &self.nodes
    }

    /// Whether the configuration leaves the model rigid.
    pub fn is_rigid(&self) -> bool {
        !self.config.warp.enabled
    }

    /// Takes the matches from the last fused frame to the next one; more than there is room for are left out.
    pub fn set_matches(&mut self, gpu: &Gpu, matches: &[Correspondence]) -> Result<(), GpuError> {
        let row = |pair: &Correspondence| -> Row {
            let ([from_x, from_y], [x, y]) = (pair.previous_pixel, pair.pixel);
            [from_x, from_y, x, y]
        };
        let first = self.before.patches as usize;
        let rows: Vec<Row> = matches.iter().take(self.before.matches.len() - first).map(row).collect();
        self.matches = rows.len() as u32;
        gpu.write(&self.before.matches, first, &rows)
    }

    /// Takes up material points in the model's present shape.
    pub fn follow(&mut self, gpu: &Gpu, points: &[(u32, Point3<f64>)]) -> Result<(), GpuError> {
        self.followed.add(gpu, GraphSettings::new(&self.config.nodes), points)
    }

    /// Where the material points are now.
    pub fn followed(&self, gpu: &Gpu) -> Result<Vec<(u32, Point3<f64>)>, GpuError> {
        self.followed.read(gpu)
    }

    /// The nodes, by slot.
    pub fn nodes(&self, gpu: &Gpu) -> Result<Vec<Node>, GpuError> {
        let rows = gpu.read(&self.nodes.rows)?;
        let node = |&[x, y, z, key]: &Bits| Node {
            id: key - 1,
            position: Point3::new(x, y, z).map(|bits| f64::from(f32::from_bits(bits))),
        };
        Ok(rows.iter().filter(|row| row[3] != 0).map(node).collect())
    }

    /// Sets the frame's counters and uses the matches up.
    pub fn prepare(
        &mut self,
        gpu: &Gpu,
        bound: &mut BoundWarp,
        (surfels, frame, tick): (u32, u32, u32),
        since: SinceLast,
    ) -> Result<(), GpuError> {
        let graph = GraphSettings { surfels, frame, tick, ..GraphSettings::new(&self.config.nodes) };
        gpu.write(&self.nodes.settings, 0, &[graph])?;
        let matches = std::mem::take(&mut self.matches);
        bound.flow.prepare(gpu, self.keyframe.advance(since.continues))?;
        let solve = Solve {
            matches: self.before.patches + matches,
            room: 2 * self.last_solved + ROOM_TO_SPARE,
            hold_pose: since.at_rest,
        };
        bound.solver.prepare(gpu, &solve)
    }

    /// Follows the tissue in the pictures, solves for the warp, takes the corrected pose over into the frame's view, and moves surfels and nodes.
    pub fn record_warp(
        &self,
        frame: &mut FrameRecorder,
        bound: &BoundWarp,
        (buffers, surfels): (&FrameBuffers, u32),
    ) -> Result<(), GpuError> {
        bound.flow.record(frame)?;
        bound.solver.record(frame)?;
        frame.copy(&self.solver.refined, &buffers.view, 1)?;
        self.record_move(frame, bound, surfels)
    }

    /// Takes over corrections of the map; `view` is the last frame's as they leave it.
    pub fn prepare_bend(
        &self,
        gpu: &Gpu,
        surfels: u32,
        corrections: &[FrameCorrection],
        view: View,
    ) -> Result<(), GpuError> {
        gpu.write(
            &self.nodes.settings,
            0,
            &[GraphSettings { surfels, ..GraphSettings::new(&self.config.nodes) }],
        )?;
        gpu.write(&self.before.view, 0, &[view.to_gpu()])?;
        self.corrections.write(gpu, corrections)
    }

    /// Bends everything that the nodes carry, and moves them.
    pub fn record_bend(
        &self,
        frame: &mut FrameRecorder,
        bound: &BoundWarp,
        surfels: u32,
    ) -> Result<(), GpuError> {
        bound.bend.record(frame, surfels)?;
        self.record_move(frame, bound, surfels)?;
        bound.graph.finder.record(frame)
    }

    /// Moves surfels, points and nodes by the nodes' transforms.
    fn record_move(
        &self,
        frame: &mut FrameRecorder,
        bound: &BoundWarp,
        surfels: u32,
    ) -> Result<(), GpuError> {
        bound.stirred.record(frame)?;
        bound.surfels.record(frame, surfels)?;
        self.followed.record_warp(frame, &bound.points)?;
        bound.patches.record_warp(frame, self.keyframe.patches)?;
        bound.nodes.record(frame)
    }

    /// Records the growth of the graph and keeps what the next frame needs of this one.
    pub fn record_end(
        &self,
        frame: &mut FrameRecorder,
        bound: &BoundWarp,
        (buffers, surfels): (&FrameBuffers, u32),
    ) -> Result<(), GpuError> {
        self.followed.record_snap(frame, &bound.points)?;
        if !self.is_rigid() {
            bound.graph.record(frame, surfels)?;
            frame.copy(&buffers.observation.depth, &self.before.depth, self.before.depth.len())?;
            frame.copy(&self.solver.refined, &self.before.view, 1)?;
            if self.keyframe.is_due() {
                bound.flow.record_keyframe(frame, &self.keyframe, &buffers.observation)?;
            }
            bound.patches.record_snap(frame, self.keyframe.patches)?;
        }
        self.node_state.fetch(frame, &self.nodes.state, 0);
        self.solver_state.fetch(frame, &self.solver.state, 0);
        self.refined.fetch(frame, &self.solver.refined, 0);
        Ok(())
    }

    /// Reads what the submitted frame did; `tracked` is the pose that it began with.
    pub fn finish(&mut self, gpu: &Gpu, tracked: &Pose) -> Result<WarpReport, GpuError> {
        let nodes = self.node_state.read(gpu)?[ALIVE_NODES];
        let state = self.solver_state.read(gpu)?[0];
        let refined = self.refined.read(gpu)?[0];
        self.last_solved = state.solved;
        Ok(WarpReport {
            nodes,
            solved: state.solved,
            steps: state.accepted,
            energy_left: f64::from(state.energy) / f64::from(state.first_energy).max(f64::MIN_POSITIVE),
            world_from_camera: if self.is_rigid() { *tracked } else { refined.world_from_camera() },
        })
    }
}
