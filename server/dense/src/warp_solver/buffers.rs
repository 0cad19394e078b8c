//! The solver's own memory. Per solved node about 10 KiB, nearly all of it the blocks of its 20 edges.

use gpu::{FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::{SolverSettings, SolverState, WarpConfig};
use crate::Observation;
use crate::index_map::IndexMap;
use crate::node_graph::{EDGES, NodeStore};
use crate::store::{Bits, Row, SurfelStore};
use crate::view::GpuView;

/// Invocations that sum over all residuals; as in `solver.wgsl`.
const PARTIALS: usize = 512;
/// Sums of each of them for the pose.
const POSE_SUMS: usize = 28;
/// Runs of residuals; as in `solver.wgsl`.
const RUNS: usize = 64;
/// Vectors of four in a node's own block, in the block of an edge, and in the border.
const OWN: usize = 36;
const EDGE: usize = 24;
const BORDER: usize = 21;

/// What the solver reads of the frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolverParts<'a> {
    pub view: &'a GpuBuffer<GpuView>,
    pub index_scale: &'a GpuBuffer<u32>,
    pub index_map: &'a IndexMap,
    pub observation: &'a Observation,
    pub surfels: &'a SurfelStore,
    pub nodes: &'a NodeStore,
    pub before: &'a FrameBefore,
    /// Where the tissue of each patch is: `Keyframe::tissue`.
    pub tissue: &'a GpuBuffer<Row>,
    /// Counts and verdict of the frame.
    pub results: &'a GpuBuffer<u32>,
}

/// What is kept of the last frame, and the matches that lead from it to this one.
#[derive(Clone, Debug)]
pub(crate) struct FrameBefore {
    /// Depth then, m.
    pub depth: GpuBuffer<f32>,
    /// Corrected view then.
    pub view: GpuBuffer<GpuView>,
    /// Earlier pixel and pixel of each match: first those of the patches, then those of the tracker.
    pub matches: GpuBuffer<Row>,
    /// How many are of patches.
    pub patches: u32,
}

impl FrameBefore {
    /// For pictures like `observation`; to be cleared before use.
    pub fn new(
        gpu: &Gpu,
        observation: &Observation,
        patches: u32,
        config: &WarpConfig,
    ) -> Result<Self, GpuError> {
        Ok(Self {
            depth: gpu.storage("depth before", observation.depth.len())?,
            view: gpu.storage("view before", 1)?,
            matches: gpu.storage("matches", (patches + config.matches_max).max(1) as usize)?,
            patches,
        })
    }

    /// Knows of no frame.
    pub fn clear(&self, frame: &mut FrameRecorder) {
        frame.clear(&self.depth);
        frame.clear(&self.view);
    }
}

/// All buffers of the solver; the names are those in its kernels.
#[derive(Clone, Debug)]
pub(crate) struct SolverBuffers {
    pub settings: GpuBuffer<SolverSettings>,
    pub state: GpuBuffer<SolverState>,
    pub refined: GpuBuffer<GpuView>,
    // per residual
    pub anchors: GpuBuffer<Bits>,
    pub weights: GpuBuffer<Row>,
    pub points: GpuBuffer<Row>,
    pub normals: GpuBuffer<Row>,
    pub planes: GpuBuffer<Row>,
    pub robust: GpuBuffer<[f32; 2]>,
    pub places: GpuBuffer<Bits>,
    pub unjoined: GpuBuffer<u32>,
    pub gradients: GpuBuffer<Row>,
    pub in_camera: GpuBuffer<Row>,
    // per residual and corner
    pub listed: GpuBuffer<u32>,
    pub entries: GpuBuffer<u32>,
    pub joints: GpuBuffer<u32>,
    pub shared_entries: GpuBuffer<u32>,
    // per node slot and run of residuals: counts, then offsets
    pub run_counts: GpuBuffer<u32>,
    // per node slot
    pub node_counts: GpuBuffer<u32>,
    pub marks: GpuBuffer<u32>,
    pub estimates: GpuBuffer<Row>,
    pub solve_index: GpuBuffer<u32>,
    pub starts: GpuBuffer<u32>,
    // per solved node
    pub solved: GpuBuffer<u32>,
    pub shared_ends: GpuBuffer<u32>,
    pub blocks: GpuBuffer<Row>,
    pub own_blocks: GpuBuffer<Row>,
    pub border: GpuBuffer<Row>,
    pub factors: GpuBuffer<Row>,
    pub steps: GpuBuffer<Row>,
    pub remainders: GpuBuffer<Row>,
    pub quotients: GpuBuffer<Row>,
    pub directions: GpuBuffer<Row>,
    pub products: GpuBuffer<Row>,
    pub curvatures: GpuBuffer<f32>,
    pub descents: GpuBuffer<Row>,
    // partial sums
    pub pose_partials: GpuBuffer<f32>,
    pub energies: GpuBuffer<f32>,
}

impl SolverBuffers {
    /// For the residuals of `settings`, with `matches` of them at most, and `nodes` slots.
    pub fn new(
        gpu: &Gpu,
        settings: &SolverSettings,
        config: &WarpConfig,
        (nodes, matches): (usize, usize),
    ) -> Result<Self, GpuError> {
        let all = SolverSettings { matches: matches as u32, ..*settings };
        let (residuals, solved) = (all.residuals() as usize, config.solved_max as usize);
        let rows = |label, len| gpu.storage::<Row>(label, len);
        Ok(Self {
            settings: gpu.uniform("solver settings", settings)?,
            state: gpu.storage("solver state", 1)?,
            refined: gpu.storage("refined view", 1)?,
            anchors: gpu.storage("anchors", residuals)?,
            weights: rows("anchor weights", residuals)?,
            points: rows("residual points", residuals)?,
            normals: rows("residual normals", residuals)?,
            planes: rows("residual planes", residuals)?,
            robust: gpu.storage("residual weights", residuals)?,
            places: gpu.storage("residual places", residuals)?,
            unjoined: gpu.storage("unjoined pairs", residuals)?,
            gradients: rows("residual gradients", residuals)?,
            in_camera: rows("residual values", residuals)?,
            listed: gpu.storage("listed residuals", 4 * residuals)?,
            entries: gpu.storage("sorted residuals", 4 * residuals)?,
            joints: gpu.storage("residual joints", 4 * residuals)?,
            shared_entries: gpu.storage("shared residuals", 12 * residuals)?,
            shared_ends: gpu.storage("shared residual ends", EDGES * solved)?,
            run_counts: gpu.storage("node residuals by run", RUNS * nodes)?,
            node_counts: gpu.storage("node residuals", nodes)?,
            marks: gpu.storage("marked nodes", nodes)?,
            estimates: rows("estimates", 6 * nodes)?,
            solve_index: gpu.storage("solve index", nodes)?,
            starts: gpu.storage("residual starts", nodes)?,
            solved: gpu.storage("solved nodes", solved)?,
            blocks: rows("edge blocks", EDGE * EDGES * solved)?,
            own_blocks: rows("own blocks", OWN * solved)?,
            border: rows("border", BORDER * solved)?,
            factors: rows("factors", OWN * solved)?,
            steps: rows("steps", 3 * solved)?,
            remainders: rows("remainders", 3 * solved)?,
            quotients: rows("quotients", 3 * solved)?,
            directions: rows("directions", 6 * solved)?,
            products: rows("products", 3 * solved)?,
            curvatures: gpu.storage("curvatures", 3 * solved)?,
            descents: rows("descents", 2 * solved)?,
            pose_partials: gpu.storage("pose sums", PARTIALS * POSE_SUMS)?,
            energies: gpu.storage("energy sums", PARTIALS)?,
        })
    }
}
