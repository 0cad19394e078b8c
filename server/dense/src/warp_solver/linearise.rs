//! Wrapper of `linearise.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "linearise",
    concat!(
        include_str!("linearise.wgsl"),
        include_str!("estimate.wgsl"),
        include_str!("warped.wgsl"),
        include_str!("pose.wgsl"),
        include_str!("solver.wgsl")
    ),
    &[
        Uniform, Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, ReadWrite, ReadWrite,
        ReadWrite, ReadWrite,
    ],
);

/// Reads estimate and depth, writes (`planes`, `robust`, `gradients`, `in_camera`).
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            parts.view,
            &solver.settings,
            &solver.state,
            &parts.nodes.rows,
            &solver.estimates,
            &solver.anchors,
            &solver.weights,
            &solver.points,
            &solver.normals,
            &parts.observation.depth,
            &parts.observation.sigma_z,
            &parts.observation.normal,
            &solver.planes,
            &solver.robust,
            &solver.gradients,
            &solver.in_camera,
        ],
    )
}
