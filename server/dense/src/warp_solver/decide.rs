//! Wrapper of `decide.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "decide",
    concat!(include_str!("decide.wgsl"), include_str!("pose.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, ReadWrite],
);

/// Reads `energies`, accepts or rejects.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&solver.settings, &solver.energies, &solver.state])
}
