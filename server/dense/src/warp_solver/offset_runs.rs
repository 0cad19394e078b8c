//! Wrapper of `offset_runs.wgsl`.

use gpu::Binding::ReadWrite;
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "offset_runs",
    concat!(include_str!("offset_runs.wgsl"), include_str!("solver.wgsl")),
    &[ReadWrite, ReadWrite],
);

/// Turns `run_counts` into offsets, writes `node_counts`.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&solver.run_counts, &solver.node_counts])
}
