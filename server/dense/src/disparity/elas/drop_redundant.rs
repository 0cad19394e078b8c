//! Wrapper of `drop_redundant.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::Binding::{ReadWrite, Uniform};
use gpu::{BoundKernel, Gpu, GpuError, KernelDeclaration};

use super::buffers::Buffers;
use super::search::Search;

pub(super) const DECLARATION: KernelDeclaration = KernelDeclaration::new(
    "drop_redundant",
    concat!(include_str!("drop_redundant.wgsl"), include_str!("search.wgsl")),
    &[Uniform, Uniform, ReadWrite],
);

/// `Lines` of the WGSL.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Lines {
    pub along: u32,
    pub across: u32,
    pub length: u32,
    pub count: u32,
}

impl Lines {
    /// Along the columns of the candidates, then along their rows.
    pub fn both(search: &Search) -> [Self; 2] {
        let (columns, rows) = (search.columns, search.rows);
        [
            Self { along: columns, across: 1, length: rows, count: columns },
            Self { along: 1, across: columns, length: columns, count: rows },
        ]
    }
}

/// Drops support points in place.
pub(super) fn bind(gpu: &Gpu, lines: &Lines, buffers: &Buffers) -> Result<BoundKernel, GpuError> {
    let lines = gpu.uniform("candidate lines", lines)?;
    gpu.kernel(&DECLARATION)?.bind(gpu, &[&buffers.search, &lines, &buffers.plausible])
}
