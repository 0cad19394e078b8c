//! Wrapper of `assemble_nodes.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "assemble_nodes",
    concat!(
        include_str!("assemble_nodes.wgsl"),
        include_str!("outer_products.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads the linearised residuals, writes `own_blocks`.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.settings,
            &solver.state,
            &parts.nodes.rows,
            &parts.nodes.edges,
            &solver.solved,
            &solver.starts,
            &solver.node_counts,
            &solver.entries,
            &solver.weights,
            &solver.unjoined,
            &solver.points,
            &solver.gradients,
            &solver.estimates,
            &solver.own_blocks,
        ],
    )
}
