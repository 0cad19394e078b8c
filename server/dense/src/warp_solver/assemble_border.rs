//! Wrapper of `assemble_border.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "assemble_border",
    concat!(
        include_str!("assemble_border.wgsl"),
        include_str!("estimate.wgsl"),
        include_str!("node_terms.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads the linearised residuals, writes `border`.
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
            &solver.points,
            &solver.planes,
            &solver.gradients,
            &solver.in_camera,
            &solver.estimates,
            &solver.border,
        ],
    )
}
