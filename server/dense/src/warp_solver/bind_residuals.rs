//! Wrapper of `bind_residuals.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::{SolverBuffers, SolverParts};

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "bind_residuals",
    concat!(include_str!("bind_residuals.wgsl"), include_str!("solver.wgsl")),
    &[
        Uniform, Uniform, Uniform, Uniform, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read, Read,
        Read, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite, ReadWrite,
    ],
);

/// Reads model and pictures, writes the residuals and counts them per node and run.
pub(super) fn bind(gpu: &Gpu, parts: &SolverParts, solver: &SolverBuffers) -> Result<BoundKernel, GpuError> {
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            parts.view,
            &parts.nodes.settings,
            &solver.settings,
            parts.index_scale,
            &parts.nodes.rows,
            &parts.nodes.hash.heads,
            &parts.nodes.hash.next,
            &parts.index_map.slots,
            &parts.surfels.geometry,
            &parts.surfels.orientation,
            &parts.observation.depth,
            &parts.observation.sigma_z,
            &parts.before.matches,
            &parts.before.depth,
            &parts.before.view,
            parts.tissue,
            &solver.anchors,
            &solver.weights,
            &solver.points,
            &solver.normals,
            &solver.planes,
            &solver.robust,
            &solver.run_counts,
            &solver.places,
        ],
    )
}
