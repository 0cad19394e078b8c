//! Wrapper of `assemble_edges.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "assemble_edges",
    concat!(
        include_str!("assemble_edges.wgsl"),
        include_str!("outer_products.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads the linearised residuals, writes `blocks`.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.settings,
            &solver.state,
            &parts.nodes.rows,
            &parts.nodes.edges,
            &solver.solved,
            &solver.solve_index,
            &solver.starts,
            &solver.shared_ends,
            &solver.shared_entries,
            &solver.weights,
            &solver.points,
            &solver.gradients,
            &solver.blocks,
        ],
    )
}
