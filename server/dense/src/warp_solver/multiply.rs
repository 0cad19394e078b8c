//! Wrapper of `multiply.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "multiply",
    concat!(include_str!("multiply.wgsl"), include_str!("solver.wgsl")),
    &[Read, Uniform, Read, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite, ReadWrite],
);

/// Reads the blocks, writes `directions`, `products` and `curvatures`; `turn` is 0, 1, 0, ...
pub(super) fn bind(
    gpu: &Gpu,
    parts: &SolverParts,
    solver: &SolverBuffers,
    turn: &GpuBuffer<u32>,
) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.state,
            turn,
            &parts.nodes.edges,
            &solver.solved,
            &solver.solve_index,
            &solver.own_blocks,
            &solver.blocks,
            &solver.border,
            &solver.quotients,
            &solver.directions,
            &solver.products,
            &solver.curvatures,
        ],
    )
}
