//! Wrapper of `aggregate.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{Read, ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuBuffer, GpuError, KernelDeclaration};

use super::band::Band;
use super::buffers::Volumes;
use super::config::SgmConfig;
use super::unroll::UnrolledText;
use crate::preprocess::EyeBuffers;

static TEXT: UnrolledText =
    UnrolledText::new(concat!(include_str!("aggregate.wgsl"), include_str!("common.wgsl")));

pub(super) fn declaration(groups: u32) -> KernelDeclaration {
    KernelDeclaration::new("aggregate", TEXT.text(groups), &[Uniform, Uniform, Read, Read, ReadWrite])
}

/// Steps of the paths; two neighbours share a volume. The first four are those of `paths = 4`.
pub(super) const STEPS: [(i32, i32); 8] =
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (-1, 1), (1, -1)];

/// `Walk` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Walk {
    pub step_x: i32,
    pub step_y: i32,
    pub accumulate: u32,
    pub small_penalty: u32,
    pub jump_penalty_max: u32,
    pub jump_penalty_min: u32,
    pub gradient_sixteenths: u32,
    padding: u32,
}

impl Walk {
    /// The path number `index` of [`STEPS`].
    pub fn new(index: usize, config: &SgmConfig) -> Self {
        let (step_x, step_y) = STEPS[index];
        Self {
            step_x,
            step_y,
            accumulate: index as u32 % 2,
            small_penalty: config.small_penalty,
            jump_penalty_max: config.jump_penalty_max,
            jump_penalty_min: config.jump_penalty_min,
            gradient_sixteenths: (config.jump_penalty_per_level * 16.0).round() as u32,
            padding: 0,
        }
    }
}

/// Reads the costs of a band, writes or adds to the volume of this path.
pub(super) fn bind(
    gpu: &Gpu,
    band: &GpuBuffer<Band>,
    walk: &Walk,
    (groups, volume): (u32, usize),
    (left, volumes): (&EyeBuffers, &Volumes),
) -> Result<BoundKernel, GpuError> {
    let walk = gpu.uniform("walk", walk)?;
    let sums = &volumes.sums[volume];
    gpu.kernel(&declaration(groups))?.bind(gpu, &[band, &walk, &left.luma, &volumes.costs, sums])
}
