//! Wrapper of `sum_pose.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "sum_pose",
    concat!(
        include_str!("sum_pose.wgsl"),
        include_str!("estimate.wgsl"),
        include_str!("node_terms.wgsl"),
        include_str!("node_energy.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, ReadWrite],
);

/// Reads the linearised residuals, writes `pose_partials`.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            &solver.settings,
            &solver.state,
            &parts.nodes.rows,
            &parts.nodes.edges,
            &solver.solved,
            &solver.solve_index,
            &solver.estimates,
            &solver.planes,
            &solver.robust,
            &solver.gradients,
            &solver.in_camera,
            &solver.pose_partials,
        ],
    )
}
