//! Wrapper of `take_step.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "take_step",
    concat!(include_str!("take_step.wgsl"), include_str!("solver.wgsl")),
    &[Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads `steps`, writes the estimate on trial.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?
        .bind(gpu, &[&parts.nodes.rows, &solver.solved, &solver.steps, &solver.estimates, &solver.state])
}
