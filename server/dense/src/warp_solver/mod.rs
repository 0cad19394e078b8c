//! Solves for the warp of one frame and for the pose (paper sections "Energy function" and "Optimization"):
//! Levenberg-Marquardt with preconditioned conjugate gradients, from index map to node transforms without a readback.
//!
//! # Why the normal matrix is assembled
//!
//! A data residual touches 4 nodes with 12 unknowns each, and its gradient is rank one: `w_j (R^T n) (x) [v - g_j; 1]`. Per
//! step of conjugate gradients a matrix-free product reads about 150 bytes for each residual and 50 for each of its four
//! corners: 7 MB for 20,000 residuals. The blocks of 500 nodes and their edges are 3 MB, need one dispatch instead of two,
//! and are summed once per step of Levenberg-Marquardt. The rank-one form keeps a block between nodes at 96 numbers, not
//! 144. A rejected step changes only the damping, and assembles nothing.
//!
//! # Order of sums
//!
//! Residuals are listed by node once per frame and sorted within each list, so each sum runs in one order, in one
//! invocation; sums over all nodes run over fixed strides. There is no floating-point atomic. An entry's place is found by
//! comparing it with those of its run of residuals alone, and each edge has a list of its own of what its two nodes share.
//!
//! # Dispatches
//!
//! 7 to set up, 11 + 4 `descent_steps` per step of Levenberg-Marquardt, 1 to finish.

mod advance;
mod assemble_border;
mod assemble_edges;
mod assemble_nodes;
mod bind_residuals;
mod buffers;
mod config;
mod decide;
mod evaluate;
mod finish_warp;
mod linearise;
mod list_joints;
mod list_residuals;
mod mark_solved;
mod multiply;
mod offset_runs;
#[cfg(test)]
mod oracle;
mod plan_solve;
mod prepare_pose;
mod reduce_curvature;
mod reduce_descent;
mod settings;
#[cfg(test)]
mod solver_oracle;
mod sort_residuals;
mod start_descent;
mod sum_pose;
mod take_step;

pub(crate) use buffers::{FrameBefore, SolverBuffers, SolverParts};
pub use config::WarpConfig;
pub(crate) use settings::{SolverSettings, SolverState};

use gpu::{BoundKernel, FrameRecorder, Gpu, GpuError, KernelDeclaration, Stage};

use crate::node_graph::EDGES;

/// The kernels of this folder.
pub(crate) const KERNELS: [KernelDeclaration; 22] = [
    bind_residuals::DECLARATION,
    offset_runs::DECLARATION,
    mark_solved::DECLARATION,
    plan_solve::DECLARATION,
    list_residuals::DECLARATION,
    sort_residuals::DECLARATION,
    list_joints::DECLARATION,
    linearise::DECLARATION,
    assemble_edges::DECLARATION,
    assemble_nodes::DECLARATION,
    assemble_border::DECLARATION,
    sum_pose::DECLARATION,
    prepare_pose::DECLARATION,
    start_descent::DECLARATION,
    multiply::DECLARATION,
    reduce_curvature::DECLARATION,
    advance::DECLARATION,
    reduce_descent::DECLARATION,
    take_step::DECLARATION,
    evaluate::DECLARATION,
    decide::DECLARATION,
    finish_warp::DECLARATION,
];

/// Invocations of the sums over all residuals.
const PARTIALS: u32 = 512;

/// What is to be solved in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solve {
    /// Matches in `FrameBefore::matches`, those of patches among them.
    pub matches: u32,
    /// The most nodes.
    pub room: u32,
    /// Whether the pose is known.
    pub hold_pose: bool,
}

/// The solver, bound to a frame's buffers.
#[derive(Debug)]
pub(crate) struct WarpSolver {
    buffers: SolverBuffers,
    config: WarpConfig,
    settings: SolverSettings,
    matches_max: u32,
    node_slots: u32,
    passes: Passes,
}

#[derive(Debug)]
struct Passes {
    bind: BoundKernel,
    offsets: BoundKernel,
    mark: BoundKernel,
    plan: BoundKernel,
    list: BoundKernel,
    sort: BoundKernel,
    joints: BoundKernel,
    linearise: BoundKernel,
    edges: BoundKernel,
    nodes: BoundKernel,
    border: BoundKernel,
    pose_sums: BoundKernel,
    pose: BoundKernel,
    start: BoundKernel,
    multiply: [BoundKernel; 2],
    curvature: BoundKernel,
    advance: [BoundKernel; 2],
    descent: BoundKernel,
    step: BoundKernel,
    evaluate: BoundKernel,
    decide: BoundKernel,
    finish: BoundKernel,
}

impl WarpSolver {
    pub fn new(
        gpu: &Gpu,
        parts: &SolverParts,
        buffers: &SolverBuffers,
        config: &WarpConfig,
    ) -> Result<Self, GpuError> {
        let size = (parts.observation.width, parts.observation.height);
        Ok(Self {
            buffers: buffers.clone(),
            config: config.clone(),
            settings: SolverSettings { patches: parts.before.patches, ..SolverSettings::new(config, size) },
            matches_max: parts.before.matches.len() as u32,
            node_slots: parts.nodes.capacity(),
            passes: Passes::new(gpu, parts, buffers)?,
        })
    }

    /// Sets what is to be solved; before the submission.
    pub fn prepare(&mut self, gpu: &Gpu, solve: &Solve) -> Result<(), GpuError> {
        self.settings.matches = solve.matches.min(self.matches_max);
        self.settings.room = solve.room.min(self.config.solved_max);
        self.settings.hold_pose = u32::from(solve.hold_pose);
        gpu.write(&self.buffers.settings, 0, &[self.settings])
    }

    /// Records the whole solve; the index map must show the model in its present shape. Writes the nodes' transforms
    /// and `SolverBuffers::refined`.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.clear(&self.buffers.run_counts);
        frame.stage("warp solve", |stage| {
            self.record_plan(stage)?;
            (0..self.config.iterations).try_for_each(|_| self.record_iteration(stage))?;
            stage.run(&self.passes.finish, [self.node_slots, 1, 1])
        })
    }

    fn record_plan(&self, stage: &mut Stage) -> Result<(), GpuError> {
        let residuals = self.settings.residuals();
        stage.run(&self.passes.bind, [residuals, 1, 1])?;
        stage.run(&self.passes.offsets, [self.node_slots, 1, 1])?;
        stage.run(&self.passes.mark, [self.node_slots, 1, 1])?;
        stage.run(&self.passes.plan, [1, 1, 1])?;
        stage.run(&self.passes.list, [residuals, 1, 1])?;
        stage.run(&self.passes.sort, [4 * residuals, 1, 1])?;
        stage.run(&self.passes.joints, [self.settings.room, 1, 1])
    }

    /// One step of Levenberg-Marquardt.
    fn record_iteration(&self, stage: &mut Stage) -> Result<(), GpuError> {
        let (passes, room) = (&self.passes, self.settings.room);
        stage.run(&passes.linearise, [self.settings.residuals(), 1, 1])?;
        stage.run(&passes.edges, [EDGES as u32 * room, 1, 1])?;
        stage.run(&passes.nodes, [room, 1, 1])?;
        stage.run(&passes.border, [room, 1, 1])?;
        stage.run(&passes.pose_sums, [PARTIALS, 1, 1])?;
        stage.run(&passes.pose, [1, 1, 1])?;
        stage.run(&passes.start, [room, 1, 1])?;
        stage.run(&passes.descent, [1, 1, 1])?;
        for step in 0..self.config.descent_steps as usize {
            stage.run(&passes.multiply[step % 2], [3 * room, 1, 1])?;
            stage.run(&passes.curvature, [1, 1, 1])?;
            stage.run(&passes.advance[step % 2], [room, 1, 1])?;
            stage.run(&passes.descent, [1, 1, 1])?;
        }
        stage.run(&passes.step, [room, 1, 1])?;
        stage.run(&passes.evaluate, [PARTIALS, 1, 1])?;
        stage.run(&passes.decide, [1, 1, 1])
    }
}

impl Passes {
    fn new(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<Self, GpuError> {
        let turns = [gpu.uniform("turn", &0u32)?, gpu.uniform("turn", &1u32)?];
        Ok(Self {
            bind: bind_residuals::bind(gpu, parts, solver)?,
            offsets: offset_runs::bind(gpu, solver)?,
            mark: mark_solved::bind(gpu, parts, solver)?,
            plan: plan_solve::bind(gpu, solver)?,
            list: list_residuals::bind(gpu, parts, solver)?,
            sort: sort_residuals::bind(gpu, solver)?,
            joints: list_joints::bind(gpu, solver)?,
            linearise: linearise::bind(gpu, parts, solver)?,
            edges: assemble_edges::bind(gpu, parts, solver)?,
            nodes: assemble_nodes::bind(gpu, parts, solver)?,
            border: assemble_border::bind(gpu, parts, solver)?,
            pose_sums: sum_pose::bind(gpu, parts, solver)?,
            pose: prepare_pose::bind(gpu, solver)?,
            start: start_descent::bind(gpu, solver)?,
            multiply: [
                multiply::bind(gpu, parts, solver, &turns[0])?,
                multiply::bind(gpu, parts, solver, &turns[1])?,
            ],
            curvature: reduce_curvature::bind(gpu, solver)?,
            advance: [advance::bind(gpu, solver, &turns[0])?, advance::bind(gpu, solver, &turns[1])?],
            descent: reduce_descent::bind(gpu, solver)?,
            step: take_step::bind(gpu, parts, solver)?,
            evaluate: evaluate::bind(gpu, parts, solver)?,
            decide: decide::bind(gpu, solver)?,
            finish: finish_warp::bind(gpu, parts, solver)?,
        })
    }
}
