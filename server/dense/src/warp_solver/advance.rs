//! Wrapper of `advance.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "advance",
    concat!(include_str!("advance.wgsl"), include_str!("precondition.wgsl"), include_str!("solver.wgsl")),
    &[Read, Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads `products`, moves the vectors of the descent; `turn` as for `multiply`.
pub(super) fn bind(
    gpu: &Gpu,
    solver: &SolverBuffers,
    turn: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.state,
            turn,
            &solver.factors,
            &solver.border,
            &solver.directions,
            &solver.products,
            &solver.steps,
            &solver.remainders,
            &solver.quotients,
            &solver.descents,
        ],
    )
}
