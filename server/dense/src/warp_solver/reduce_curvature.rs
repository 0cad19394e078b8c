//! Wrapper of `reduce_curvature.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "reduce_curvature",
    concat!(include_str!("reduce_curvature.wgsl"), include_str!("solver.wgsl")),
    &[Read, ReadWrite],
);

/// Reads `curvatures`, writes the step's length.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&solver.curvatures, &solver.state])
}
