//! Left and right exchanged: then all disparities are negative, and nothing that is searched for is found.

use geometry::{Raster, Rgb};
use gpu::Gpu;

use super::compute::{Pair, compute};
use super::config::{DisparityConfig, SgmConfig};
use super::range::DisparityRange;
use crate::DenseError;

/// Longer side, in pixels, of the images that are compared: enough for this question.
const SIDE_MAX: u32 = 320;

/// How much of a pair matches as it came, and with its eyes exchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeOrder {
    /// Share of the pixels matched as they came.
    pub as_given: f64,
    /// Share of the pixels matched with left and right exchanged.
    pub exchanged: f64,
}

impl EyeOrder {
    /// Whether the right eye came as the left one. A pair of which little matches either way is not judged.
    pub fn is_swapped(&self) -> bool {
        self.exchanged > 0.25 && self.exchanged > 1.5 * self.as_given
    }
}

/// Matches a pair both ways at reduced size.
///
/// # Errors
/// As [`compute`].
pub fn eye_order(
    gpu: &Gpu,
    (left, right): (&Rgb, &Rgb),
    range: DisparityRange,
    config: &DisparityConfig,
) -> Result<EyeOrder, DenseError> {
    let factor = left.width().max(left.height()).div_ceil(SIDE_MAX).max(1);
    let scale = factor as i32;
    let max_px = range.min_px + range.count() as i32;
    let range = DisparityRange::new(range.min_px.div_euclid(scale), max_px / scale + 1)?;
    let (left, right) = (reduced(left, factor), reduced(right, factor));
    // searched in full, both views are compared at every pixel
    let config =
        &DisparityConfig { sgm: SgmConfig { coarse_level: 0, ..config.sgm.clone() }, ..config.clone() };
    let share = |left, right| {
        let map = compute(gpu, &Pair { left, right, mask: None }, range, config)?;
        Ok::<_, DenseError>(map.coverage())
    };
    Ok(EyeOrder { as_given: share(&left, &right)?, exchanged: share(&right, &left)? })
}

/// Means of squares of `factor` x `factor` pixels.
fn reduced(image: &Rgb, factor: u32) -> Rgb {
    let (width, height) = (image.width() / factor, image.height() / factor);
    Raster::from_fn(width, height, |x, y| {
        [0, 1, 2].map(|channel| {
            let row = |dy: u32| {
                (0..factor).map(move |dx| u32::from(image[(x * factor + dx, y * factor + dy)][channel]))
            };
            ((0..factor).flat_map(row).sum::<u32>() / (factor * factor)) as u8
        })
    })
}
