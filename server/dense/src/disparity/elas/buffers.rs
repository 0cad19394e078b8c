//! The buffers that the kernels of ELAS pass on.

use gpu::{Gpu, GpuBuffer, GpuError};

use super::search::Search;
use super::triangulation::Room;
use crate::disparity::band::Band;

/// Both views in one buffer each, in padded rows, the left view first.
#[derive(Debug)]
pub(super) struct Buffers {
    /// The parameters.
    pub search: GpuBuffer<Search>,
    /// Horizontal and vertical Sobel responses, four pixels a word.
    pub responses: GpuBuffer<[u32; 2]>,
    /// Descriptors, one per pixel.
    pub descriptors: GpuBuffer<[u32; 4]>,
    /// Disparity per candidate for a support point.
    pub support: GpuBuffer<i32>,
    /// The same without what is implausible or redundant.
    pub plausible: GpuBuffer<i32>,
    /// Candidate disparities of each grid cell.
    pub candidates: GpuBuffer<u32>,
    /// Least energy among the candidates.
    pub energies: GpuBuffer<u32>,
    /// Number of strips.
    pub strip_count: GpuBuffer<[u32; 4]>,
    /// The triangles of both views, cut into strips of few rows.
    pub strips: GpuBuffer<[u32; 4]>,
    /// Their corners, two elements each.
    pub corners: GpuBuffer<[i32; 4]>,
    /// Their planes.
    pub planes: GpuBuffer<[f32; 4]>,
    /// Which triangle a pixel lies in.
    pub triangle_of: GpuBuffer<u32>,
    /// Disparity and spread as matched.
    pub found: GpuBuffer<[f32; 2]>,
}

impl Buffers {
    pub fn new(gpu: &Gpu, whole: &Band, search: &Search) -> Result<Self, GpuError> {
        let words = 2 * whole.image_words();
        let pixels = 4 * words;
        let Room { triangles, strips } = Room::new(search.candidates());
        Ok(Self {
            search: gpu.uniform("elas parameters", search)?,
            responses: gpu.storage("sobel responses", words)?,
            descriptors: gpu.storage("elas descriptors", pixels)?,
            support: gpu.storage("support points", search.candidates())?,
            plausible: gpu.storage("plausible support points", search.candidates())?,
            candidates: gpu.storage("candidate disparities", search.mask_len())?,
            energies: gpu.storage("candidate energies", pixels)?,
            strip_count: gpu.uniform("strip count", &[0; 4])?,
            strips: gpu.storage("triangle strips", strips)?,
            corners: gpu.storage("triangle corners", 2 * triangles)?,
            planes: gpu.storage("triangle planes", triangles)?,
            triangle_of: gpu.storage("triangle of each pixel", pixels)?,
            found: gpu.storage("elas disparities", pixels)?,
        })
    }
}
