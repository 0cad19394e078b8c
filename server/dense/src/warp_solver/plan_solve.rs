//! Wrapper of `plan_solve.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "plan_solve",
    concat!(include_str!("plan_solve.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads `marks`, writes (`solved`, `solve_index`, `starts`); resets the state.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.settings,
            &solver.marks,
            &solver.node_counts,
            &solver.solved,
            &solver.solve_index,
            &solver.starts,
            &solver.state,
        ],
    )
}
