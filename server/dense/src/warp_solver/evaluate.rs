//! Wrapper of `evaluate.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "evaluate",
    concat!(
        include_str!("evaluate.wgsl"),
        include_str!("estimate.wgsl"),
        include_str!("warped.wgsl"),
        include_str!("node_terms.wgsl"),
        include_str!("node_energy.wgsl"),
        include_str!("pose.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[Uniform, Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads the estimate on trial, writes `energies`.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            parts.view,
            &solver.settings,
            &solver.state,
            &parts.nodes.rows,
            &parts.nodes.edges,
            &solver.solved,
            &solver.solve_index,
            &solver.estimates,
            &solver.anchors,
            &solver.weights,
            &solver.points,
            &solver.planes,
            &solver.robust,
            &solver.gradients,
            &solver.energies,
        ],
    )
}
