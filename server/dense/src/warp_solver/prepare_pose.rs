//! Wrapper of `prepare_pose.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::SolverBuffers;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "prepare_pose",
    concat!(include_str!("prepare_pose.wgsl"), include_str!("pose.wgsl"), include_str!("solver.wgsl")),
    &[Uniform, Read, ReadWrite],
);

/// Reads `pose_partials`, writes the pose's part of the state.
pub(super) fn bind(gpu: &Gpu, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&solver.settings, &solver.pose_partials, &solver.state])
}
