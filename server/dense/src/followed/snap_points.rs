//! Wrapper of `snap_points.wgsl`.

use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::Shown;
use crate::node_graph::GraphSettings;
use crate::store::Row;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "snap_points",
    include_str!("snap_points.wgsl"),
    &[Uniform, Uniform, Uniform, Read, Read, Read, Read, ReadWrite],
);

/// Reads what is shown, moves `points`.
pub(super) fn bind(
    gpu: &Gpu,
    shown: &Shown,
    settings: &GpuBuffer<GraphSettings>,
    points: &GpuBuffer<Row>,
) -> Result<BoundKernel, GpuError> {
    let surfels = shown.surfels;
    gpu.kernel(&DECLARATION)?.bind(
        gpu,
        &[
            shown.view,
            shown.index_scale,
            settings,
            &shown.index_map.slots,
            &surfels.geometry,
            &surfels.orientation,
            &surfels.history,
            points,
        ],
    )
}
