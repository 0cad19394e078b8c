//! What the tests of the matching share: pairs with known disparity, and single kernels run over them.

use std::sync::Arc;

use geometry::{Raster, Rgb};
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, StageTimer};

use super::band::{Band, volume_count};
use super::buffers::{Images, Volumes};
use super::{DisparityConfig, DisparityRange};
use crate::preprocess::Preprocess;
use crate::testing::{Numbers, gpu};

/// Sizes that are no multiple of anything.
pub const SIZES: [(u32, u32); 2] = [(37, 29), (161, 120)];

/// The shipped configuration.
pub fn config() -> DisparityConfig {
    let file: toml::Table = toml::from_str(include_str!("../../../../config/server.toml")).unwrap();
    file["disparity"].clone().try_into().unwrap()
}

/// Smooth random grey values between 30 and 220, defined between the pixels too.
pub struct Texture {
    cells: Vec<f64>,
}

const CELLS: usize = 512;

impl Texture {
    pub fn new(seed: u64) -> Self {
        let mut numbers = Numbers::new(seed);
        Self { cells: (0..CELLS * 64).map(|_| numbers.next()).collect() }
    }

    fn layer(&self, x: f64, y: f64) -> f64 {
        let (x0, y0) = (x.floor(), y.floor());
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        let (s, t) = (ease(x - x0), ease(y - y0));
        let cell = |dx: f64, dy: f64| {
            let (i, j) = ((x0 + dx).rem_euclid(CELLS as f64), (y0 + dy).rem_euclid(64.0));
            self.cells[j as usize * CELLS + i as usize]
        };
        (1.0 - t) * ((1.0 - s) * cell(0.0, 0.0) + s * cell(1.0, 0.0))
            + t * ((1.0 - s) * cell(0.0, 1.0) + s * cell(1.0, 1.0))
    }

    pub fn at(&self, x: f64, y: f64) -> f64 {
        let detail = self.layer(x / 2.7 + 11.0, y / 2.9);
        125.0 + 55.0 * detail + 40.0 * self.layer(x / 7.3, y / 6.1 + 3.0)
    }
}

/// A pair in which left pixel (x, y) has the disparity `of(x, y)`.
pub fn pair(size: (u32, u32), seed: u64, of: impl Fn(f64, f64) -> f64) -> (Rgb, Rgb) {
    let texture = Texture::new(seed);
    let image = |shift: &dyn Fn(f64, f64) -> f64| {
        Raster::from_fn(size.0, size.1, |x, y| {
            let (x, y) = (f64::from(x), f64::from(y));
            [texture.at(x - shift(x, y), y).round() as u8; 3]
        })
    };
    (image(&of), image(&|_, _| 0.0))
}

/// Random pixels, some of them black or saturated.
pub fn hostile(size: (u32, u32), seed: u64) -> Rgb {
    let mut numbers = Numbers::new(seed);
    Raster::from_fn(size.0, size.1, |_, _| match numbers.next() {
        value if value > 0.9 => [255; 3],
        value if value < -0.9 => [0; 3],
        value => [(127.0 + 120.0 * value) as u8; 3],
    })
}

/// The buffers of one image, with which single kernels are run.
pub(super) struct Bench {
    pub gpu: Arc<Gpu>,
    pub config: DisparityConfig,
    pub input: Preprocess,
    pub whole: Band,
    pub uniform: GpuBuffer<Band>,
    pub images: Images,
    pub volumes: Volumes,
}

impl Bench {
    pub fn new((left, right): (&Rgb, &Rgb), range: DisparityRange, config: DisparityConfig) -> Self {
        let gpu = gpu();
        let input = Preprocess::new(&gpu, left.size(), &config).unwrap();
        input.upload(&gpu, left, right, None).unwrap();
        let whole = Band::whole(left.size(), range);
        let sums = volume_count(&config.sgm);
        let bench = Self {
            uniform: gpu.uniform("band", &whole).unwrap(),
            images: Images::new(&gpu, &whole).unwrap(),
            volumes: Volumes::new(&gpu, whole.pixels(), range.groups, sums).unwrap(),
            gpu,
            config,
            input,
            whole,
        };
        let timer = StageTimer::new(&bench.gpu, 4).unwrap();
        let mut frame = FrameRecorder::begin(&bench.gpu, &timer);
        bench.input.record(&mut frame).unwrap();
        frame.submit().collect().unwrap();
        bench
    }

    pub fn run(&self, kernel: &BoundKernel, invocations: [u32; 3]) {
        let timer = StageTimer::new(&self.gpu, 1).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, &timer);
        frame.stage("kernel", |stage| stage.run(kernel, invocations)).unwrap();
        frame.submit().collect().unwrap();
    }

    pub fn words(&self) -> [u32; 3] {
        [self.whole.words, self.whole.height, 1]
    }

    /// The bytes of a packed image or volume.
    pub fn bytes<T: bytemuck::Pod>(&self, buffer: &GpuBuffer<T>) -> Vec<u8> {
        bytemuck::cast_slice(&self.gpu.read(buffer).unwrap()).to_vec()
    }

    /// Fills a volume with random costs up to `limit`.
    pub fn fill(&self, volume: &GpuBuffer<[u32; 4]>, seed: u64, limit: f64) -> Vec<u8> {
        let mut numbers = Numbers::new(seed);
        let bytes: Vec<u8> =
            (0..volume.len() * 16).map(|_| ((numbers.next() * 0.5 + 0.5) * limit) as u8).collect();
        self.gpu.write(volume, 0, bytemuck::cast_slice(&bytes)).unwrap();
        bytes
    }
}

/// Disparities of pixel rows out of a padded image.
pub fn unpadded(band: &Band, padded: &[[f32; 4]]) -> Vec<f32> {
    let stride = band.words as usize;
    let row = |y: usize| padded[y * stride..(y + 1) * stride].as_flattened()[..band.width as usize].to_vec();
    (0..band.height as usize).flat_map(row).collect()
}

/// A padded image with what `value(x, y)` says, and unknown padding.
pub fn padded(band: &Band, mut value: impl FnMut(u32, u32) -> f32) -> Vec<[f32; 4]> {
    let element = |index: u32| {
        let (x, y) = (index % band.words * 4, index / band.words);
        [0, 1, 2, 3].map(|lane| if x + lane < band.width { value(x + lane, y) } else { NO_DISPARITY })
    };
    (0..band.words * band.height).map(element).collect()
}

/// As in `common.wgsl`.
pub const NO_DISPARITY: f32 = -1.0e6;
