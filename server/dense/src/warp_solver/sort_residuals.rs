//! Wrapper of `sort_residuals.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "sort_residuals",
    concat!(include_str!("sort_residuals.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, Read, Read, Read, ReadWrite, Read],
);

/// Reads `listed`, writes `entries`.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.settings,
            &solver.anchors,
            &solver.starts,
            &solver.node_counts,
            &solver.listed,
            &solver.entries,
            &solver.run_counts,
        ],
    )
}
