//! Wrapper of `start_descent.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "start_descent",
    concat!(
        include_str!("start_descent.wgsl"),
        include_str!("precondition.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads the blocks, writes `factors` and the vectors of the descent.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.state,
            &solver.own_blocks,
            &solver.border,
            &solver.factors,
            &solver.steps,
            &solver.remainders,
            &solver.quotients,
            &solver.directions,
            &solver.descents,
        ],
    )
}
