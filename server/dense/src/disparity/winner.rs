//! Wrapper of `winner.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::band::Band;
use super::buffers::Volumes;
use super::unroll::UnrolledText;

static TEXT: UnrolledText =
    UnrolledText::new(concat!(include_str!("winner.wgsl"), include_str!("common.wgsl")));

pub(super) fn declaration(groups: u32) -> KernelDeclaration {
    KernelDeclaration::new(
        "winner",
        TEXT.text(groups),
        &[Uniform, Uniform, Read, Read, Read, Read, ReadWrite, ReadWrite],
    )
}

/// `Volumes` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct VolumeCount {
    count: u32,
    padding: [u32; 3],
}

/// Reads the summed paths of a band, writes the winners of both views.
pub(super) fn bind(
    gpu: &Gpu,
    band: &GpuBuffer<Band>,
    groups: u32,
    volumes: &Volumes,
) -> Result<BoundKernel, GpuError> {
    let count = gpu.uniform("volumes", &VolumeCount { count: volumes.count(), padding: [0; 3] })?;
    let [a, b, c, d] = volumes.four_sums();
    gpu.kernel(&declaration(groups))?
        .bind(gpu, &[band, &count, a, b, c, d, &volumes.left_winners, &volumes.right_winners])
}
