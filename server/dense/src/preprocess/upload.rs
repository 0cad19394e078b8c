//! Images on their way to the GPU.

use geometry::{Mask, Rgb};
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::mask;
use super::prepare::{self, Exposure};
use crate::DenseError;
use crate::disparity::DisparityConfig;

/// One eye on the GPU, in the size it came in or a reduced one.
#[derive(Debug)]
pub struct EyeBuffers {
    /// Red, green, blue from the lowest byte up; the highest byte is 255, or 0 where an instrument covers the tissue.
    /// Always of the size it came in.
    pub color: GpuBuffer<u32>,
    /// Grey values in unpadded rows, unrounded where they are means.
    pub grey: GpuBuffer<f32>,
    /// Grey values, four pixels a word, rows padded to whole words.
    pub luma: GpuBuffer<u32>,
    /// 1 where a pixel is dark, saturated or covered, else 0; packed as `luma`.
    pub masked: GpuBuffer<u32>,
}

impl EyeBuffers {
    fn new(gpu: &Gpu, (width, height): (u32, u32)) -> Result<Self, GpuError> {
        let color = gpu.storage("image", width as usize * height as usize)?;
        Self::with_color(gpu, (width, height), color)
    }

    fn with_color(gpu: &Gpu, (width, height): (u32, u32), color: GpuBuffer<u32>) -> Result<Self, GpuError> {
        let words = width.div_ceil(4) as usize * height as usize;
        Ok(Self {
            color,
            grey: gpu.storage("grey values", width as usize * height as usize)?,
            luma: gpu.storage("luma", words)?,
            masked: gpu.storage("mask", words)?,
        })
    }

    /// Room for the same eye at another size.
    pub(crate) fn resized(&self, gpu: &Gpu, size: (u32, u32)) -> Result<Self, GpuError> {
        Self::with_color(gpu, size, self.color.clone())
    }
}

/// Both eyes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eyes<'a> {
    pub left: &'a EyeBuffers,
    pub right: &'a EyeBuffers,
}

/// Uploads pairs of one size and prepares them for matching.
#[derive(Debug)]
pub struct Preprocess {
    size: (u32, u32),
    words: u32,
    mask_margin_px: u32,
    eyes: [EyeBuffers; 2],
    prepare: [BoundKernel; 2],
}

impl Preprocess {
    /// Buffers and kernels for images of `size` (columns, rows).
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn new(gpu: &Gpu, size: (u32, u32), config: &DisparityConfig) -> Result<Self, DenseError> {
        let exposure = Exposure::new(size, config);
        let words = exposure.words;
        let exposure = gpu.uniform("exposure", &exposure)?;
        let eyes = [EyeBuffers::new(gpu, size)?, EyeBuffers::new(gpu, size)?];
        let prepare = [prepare::bind(gpu, &exposure, &eyes[0])?, prepare::bind(gpu, &exposure, &eyes[1])?];
        Ok(Self { size, words, mask_margin_px: config.mask_margin_px, eyes, prepare })
    }

    /// Columns, rows.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// The left eye.
    pub fn left(&self) -> &EyeBuffers {
        &self.eyes[0]
    }

    /// The right eye.
    pub fn right(&self) -> &EyeBuffers {
        &self.eyes[1]
    }

    /// Both eyes.
    pub(crate) fn eyes(&self) -> Eyes<'_> {
        Eyes { left: &self.eyes[0], right: &self.eyes[1] }
    }

    /// Writes a pair for the next submission; `mask` covers pixels of the left eye.
    ///
    /// # Errors
    /// [`DenseError::ImageSize`].
    pub fn upload(&self, gpu: &Gpu, left: &Rgb, right: &Rgb, mask: Option<&Mask>) -> Result<(), DenseError> {
        let sizes =
            [("left", Some(left.size())), ("right", Some(right.size())), ("mask", mask.map(Mask::size))];
        for (what, found) in sizes {
            if let Some(found) = found.filter(|&found| found != self.size) {
                return Err(DenseError::ImageSize { what, found, expected: self.size });
            }
        }
        let mask = mask.map(|mask| mask::widened(mask, self.mask_margin_px));
        gpu.write(&self.eyes[0].color, 0, &packed(left, mask.as_ref()))?;
        gpu.write(&self.eyes[1].color, 0, &packed(right, None))?;
        Ok(())
    }

    /// Records grey values and masks of both eyes.
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        let words = [self.words, self.size.1, 1];
        frame
            .stage("preparation", |stage| self.prepare.iter().try_for_each(|kernel| stage.run(kernel, words)))
    }
}

fn packed(image: &Rgb, mask: Option<&Mask>) -> Vec<u32> {
    let mut words: Vec<u32> = image
        .pixels()
        .iter()
        .map(|&[red, green, blue]| u32::from_le_bytes([red, green, blue, 255]))
        .collect();
    if let Some(mask) = mask {
        for (word, _) in words.iter_mut().zip(mask.pixels()).filter(|(_, covered)| **covered != 0) {
            *word &= 0x00ff_ffff;
        }
    }
    words
}
