//! Disparity of a single pair, read back.

use geometry::{Mask, Raster, Rgb};
use gpu::{FrameRecorder, Gpu, StageTime, StageTimer};

use super::config::DisparityConfig;
use super::range::DisparityRange;
use super::stage::DisparityStage;
use crate::DenseError;
use crate::preprocess::Preprocess;

/// Passes of one frame: preparation, census, filter, and three per band.
const STAGES_MAX: u32 = 256;

/// Disparities of a left image and how sure they are.
#[derive(Clone, Debug, PartialEq)]
pub struct DisparityMap {
    /// `u_left - u_right`, pixels; infinite where unknown, as in Middlebury's PFM files.
    pub disparity: Raster<f32>,
    /// Variance, square pixels; infinite where unknown.
    pub variance: Raster<f32>,
    /// Time of each stage.
    pub stages: Vec<StageTime>,
}

impl DisparityMap {
    /// Share of the pixels that have a disparity.
    pub fn coverage(&self) -> f64 {
        let known = self.disparity.pixels().iter().filter(|disparity| disparity.is_finite()).count();
        known as f64 / self.disparity.pixels().len().max(1) as f64
    }

    /// Milliseconds of all stages.
    pub fn total_ms(&self) -> f64 {
        self.stages.iter().map(|stage| stage.ms).sum()
    }
}

/// A rectified pair, with the pixels of the left image that something covers.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// Left eye.
    pub left: &'a Rgb,
    /// Right eye.
    pub right: &'a Rgb,
    /// Instruments in the left eye.
    pub mask: Option<&'a Mask>,
}

/// Matches one rectified pair of any size.
///
/// # Errors
/// [`DenseError::ImageSize`] where the images differ in size, [`DenseError::Config`], and whatever the GPU refuses.
pub fn compute(
    gpu: &Gpu,
    pair: &Pair,
    range: DisparityRange,
    config: &DisparityConfig,
) -> Result<DisparityMap, DenseError> {
    let input = Preprocess::new(gpu, pair.left.size(), config)?;
    let disparity = DisparityStage::new(gpu, &input, range, config)?;
    let timer = StageTimer::new(gpu, STAGES_MAX)?;
    input.upload(gpu, pair.left, pair.right, pair.mask)?;
    let mut frame = FrameRecorder::begin(gpu, &timer);
    input.record(&mut frame)?;
    disparity.record(&mut frame)?;
    let times = frame.submit().collect()?;
    let planes = gpu.read(disparity.planes())?;
    let (width, height) = pair.left.size();
    let image = |value: fn(&[f32; 4]) -> f32| {
        let of_known = |plane: &[f32; 4]| if plane[0] > -1e5 { value(plane) } else { f32::INFINITY };
        Raster::from_fn(width, height, |x, y| of_known(&planes[(y * width + x) as usize]))
    };
    Ok(DisparityMap {
        disparity: image(|plane| plane[0]),
        variance: image(|plane| plane[3] * plane[3]),
        stages: times.stages,
    })
}
