//! The buffers that the disparity kernels pass on.

use gpu::{Gpu, GpuBuffer, GpuError};

use super::band::Band;

/// Whole images in rows padded to a multiple of four pixels.
#[derive(Debug)]
pub(super) struct Images {
    /// Size and range.
    pub whole: GpuBuffer<Band>,
    /// Census descriptors of the left and the right eye, four pixels an element.
    pub descriptors: [GpuBuffer<[u32; 4]>; 2],
    /// Disparities as matched, four pixels an element.
    pub matched: GpuBuffer<[f32; 4]>,
    /// Their standard deviations as far as the match knows them.
    pub spreads: GpuBuffer<[f32; 4]>,
    /// Disparities after the median and the removal of speckles.
    pub filtered: GpuBuffer<[f32; 4]>,
    /// The result, unpadded: disparity, slopes along x and y, standard deviation.
    pub planes: GpuBuffer<[f32; 4]>,
}

impl Images {
    pub fn new(gpu: &Gpu, whole: &Band) -> Result<Self, GpuError> {
        let words = whole.image_words();
        Ok(Self {
            whole: gpu.uniform("whole image", whole)?,
            descriptors: [gpu.storage("left census", words)?, gpu.storage("right census", words)?],
            matched: gpu.storage("matched disparity", words)?,
            spreads: gpu.storage("disparity spread", words)?,
            filtered: gpu.storage("filtered disparity", words)?,
            planes: gpu.storage("disparity planes", whole.pixels())?,
        })
    }
}

/// What is held per disparity or only until the winners of a band are known; bands take turns in it.
#[derive(Debug)]
pub(super) struct Volumes {
    /// Matching costs, 16 disparities an element.
    pub costs: GpuBuffer<[u32; 4]>,
    /// Path costs, two paths each: two volumes for 4 paths, four for 8.
    pub sums: Vec<GpuBuffer<[u32; 4]>>,
    /// Best and second best per left pixel.
    pub left_winners: GpuBuffer<[u32; 2]>,
    /// Best per right pixel.
    pub right_winners: GpuBuffer<u32>,
}

impl Volumes {
    /// Room for `pixels` pixels of `groups` groups of disparities.
    pub fn new(gpu: &Gpu, pixels: usize, groups: u32, sums: u32) -> Result<Self, GpuError> {
        let elements = pixels * groups as usize;
        Ok(Self {
            costs: gpu.storage("matching costs", elements)?,
            sums: (0..sums).map(|_| gpu.storage("path costs", elements)).collect::<Result<_, _>>()?,
            left_winners: gpu.storage("left winners", pixels)?,
            right_winners: gpu.storage("right winners", pixels)?,
        })
    }

    pub fn count(&self) -> u32 {
        self.sums.len() as u32
    }

    /// The sums for kernels that bind four volumes; of two, each comes twice and the kernel reads the first pair.
    pub fn four_sums(&self) -> [&GpuBuffer<[u32; 4]>; 4] {
        let count = self.sums.len();
        [0, 1, 2, 3].map(|index| &self.sums[index % count])
    }
}
