//! Wrapper of `list_joints.wgsl`.

use gpu::Binding::{Read, ReadWrite};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "list_joints",
    concat!(include_str!("list_joints.wgsl"), include_str!("solver.wgsl")),
    &[Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite],
);

/// Reads `entries` and `joints`, writes (`shared_ends`, `shared_entries`).
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.state,
            &solver.solved,
            &solver.starts,
            &solver.node_counts,
            &solver.entries,
            &solver.joints,
            &solver.shared_ends,
            &solver.shared_entries,
        ],
    )
}
