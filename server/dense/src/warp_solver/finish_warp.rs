//! Wrapper of `finish_warp.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "finish_warp",
    concat!(include_str!("finish_warp.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads the estimate, writes transforms and the refined view.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            parts.view,
            &solver.state,
            &parts.nodes.rows,
            &solver.estimates,
            parts.results,
            &parts.nodes.transforms,
            &solver.refined,
        ],
    )
}
