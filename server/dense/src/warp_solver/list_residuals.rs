//! Wrapper of `list_residuals.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "list_residuals",
    concat!(include_str!("list_residuals.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, Read, Read, Read, Read, ReadWrite, ReadWrite, Read, ReadWrite],
);

/// Reads the residuals, writes (`listed`, `unjoined`, `joints`).
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.settings,
            &solver.anchors,
            &solver.places,
            &solver.starts,
            &solver.solve_index,
            &parts.nodes.edges,
            &solver.listed,
            &solver.unjoined,
            &solver.run_counts,
            &solver.joints,
        ],
    )
}
