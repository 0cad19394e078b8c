//! What the tests of ELAS share: its buffers over a pair, and its kernels run one by one.

use geometry::{Gray, Rgb};
use gpu::BoundKernel;

use super::buffers::Buffers;
use super::search::Search;
use super::triangulation::NO_SUPPORT;
use super::{describe, sobel};
use crate::disparity::testing::{Bench, config, hostile, pair};
use crate::disparity::{DisparityConfig, DisparityRange};
use crate::testing::Numbers;

/// One pixel's 16 responses.
pub type Descriptor = [u8; 16];

/// The buffers of a pair.
pub struct ElasBench {
    pub bench: Bench,
    pub search: Search,
    pub buffers: Buffers,
}

impl ElasBench {
    pub fn new(eyes: (&Rgb, &Rgb), config: DisparityConfig) -> Self {
        let bench = Bench::new(eyes, DisparityRange { min_px: -4, groups: 3 }, config);
        let search = Search::new(&bench.whole, &bench.config.elas);
        let buffers = Buffers::new(&bench.gpu, &bench.whole, &search).unwrap();
        Self { bench, search, buffers }
    }

    /// With the descriptors of a pair that matches in part: a textured plane with random pixels strewn in.
    pub fn described(size: (u32, u32), seed: u64) -> Self {
        let (mut left, mut right) = pair(size, seed, |x, y| 4.0 + 0.06 * x + 0.03 * y);
        for (image, seed) in [(&mut left, seed + 1), (&mut right, seed + 2)] {
            let noise = hostile(size, seed);
            let mut numbers = Numbers::new(seed);
            for y in 0..size.1 {
                for x in 0..size.0 {
                    if numbers.next() > 0.97 {
                        image[(x, y)] = noise[(x, y)];
                    }
                }
            }
        }
        let bench = Self::new((&left, &right), config());
        bench.run_images(
            &sobel::bind(bench.gpu(), &bench.bench.images, &bench.bench.input, &bench.buffers).unwrap(),
        );
        bench.run_images(
            &describe::bind(bench.gpu(), &bench.bench.images, &bench.bench.input, &bench.buffers).unwrap(),
        );
        bench
    }

    pub fn gpu(&self) -> &gpu::Gpu {
        &self.bench.gpu
    }

    /// Columns, rows.
    pub fn size(&self) -> (u32, u32) {
        (self.bench.whole.width, self.bench.whole.height)
    }

    /// Runs a kernel over the words of both views.
    pub fn run_images(&self, kernel: &BoundKernel) {
        self.bench.run(kernel, [self.bench.whole.words, self.bench.whole.height, 2]);
    }

    /// Runs a kernel over the pixels of both views.
    pub fn run_pixels(&self, kernel: &BoundKernel) {
        self.bench.run(kernel, [self.bench.whole.width, self.bench.whole.height, 2]);
    }

    /// Index of a pixel of a view in padded rows.
    pub fn index(&self, view: u32, x: u32, y: u32) -> usize {
        ((view * self.bench.whole.height + y) * 4 * self.bench.whole.words + x) as usize
    }

    /// The partner's column, where it lies in the image.
    pub fn partner(&self, view: u32, x: u32, disparity: i32) -> Option<u32> {
        let step = if view == 0 { -1 } else { 1 };
        let partner = x as i32 + step * disparity;
        (0..self.size().0 as i32).contains(&partner).then_some(partner as u32)
    }

    /// The descriptors of both views.
    pub fn descriptors(&self) -> Vec<Descriptor> {
        let words = self.gpu().read(&self.buffers.descriptors).unwrap();
        bytemuck::cast_slice(&words).to_vec()
    }
}

/// Sum of absolute differences.
pub fn difference(a: &Descriptor, b: &Descriptor) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum()
}

/// Sum of the responses' magnitudes.
pub fn texture(descriptor: &Descriptor) -> u32 {
    difference(descriptor, &[128; 16])
}

/// A pixel that gives no depth.
pub fn is_silent(descriptor: &Descriptor) -> bool {
    *descriptor == [0; 16]
}

/// Disparities for candidates: two surfaces with outliers and gaps.
pub fn random_support(search: &Search, seed: u64) -> Vec<i32> {
    let mut numbers = Numbers::new(seed);
    let value = |index: usize| {
        let column = index % search.columns as usize;
        let surface = if column > search.columns as usize / 2 { 20.0 } else { 8.0 };
        match numbers.next() {
            hole if hole > 0.4 => NO_SUPPORT,
            outlier if outlier < -0.9 => (18.0 + 21.0 * numbers.next()) as i32,
            _ => (surface + 1.5 * numbers.next()) as i32,
        }
    };
    (0..search.candidates()).map(value).collect()
}

/// The grey value at a place, that of the border beyond it.
pub fn clamped(luma: &Gray, x: i64, y: i64) -> i32 {
    let (right, bottom) = (i64::from(luma.width()) - 1, i64::from(luma.height()) - 1);
    luma[(x.clamp(0, right) as u32, y.clamp(0, bottom) as u32)].into()
}
