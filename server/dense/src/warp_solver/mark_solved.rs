//! Wrapper of `mark_solved.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "mark_solved",
    concat!(include_str!("mark_solved.wgsl"), include_str!("solver.wgsl")),
    &[Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the counts, writes `marks`; resets `estimates`.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[&parts.nodes.rows, &parts.nodes.edges, &solver.node_counts, &solver.marks, &solver.estimates],
    )
}
