//! Wrapper of `reduce_descent.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "reduce_descent",
    concat!(include_str!("reduce_descent.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, ReadWrite],
);

/// Reads `descents`, writes the next direction's share.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&solver.settings, &solver.descents, &solver.state])
}
