//! Look-up tables that resample an image, computed once and applied to every frame.

use nalgebra::Point2;

use crate::{Mask, Raster};

/// Weights are 1/256 of a pixel: the place of a sample is off by 1/512 px at most.
const WEIGHT_ONE: u32 = 256;
/// Half of the weights' product, for rounding.
const HALF: u32 = WEIGHT_ONE * WEIGHT_ONE / 2;
/// `top_left` of a pixel that has no source.
const OUTSIDE: u32 = u32::MAX;
/// Mask value of pixels without a source.
const COVERED: u8 = 255;

/// Where one output pixel comes from: four source pixels and two weights.
#[derive(Clone, Copy, Debug)]
struct Tap {
    /// Index of the upper left source pixel, or [`OUTSIDE`].
    top_left: u32,
    /// Weight of the right column, 0 to [`WEIGHT_ONE`].
    right: u16,
    /// Weight of the lower row, 0 to [`WEIGHT_ONE`].
    bottom: u16,
}

/// The source of every output pixel; input and output have one size.
#[derive(Clone, Debug)]
pub(crate) struct RemapTable {
    width_px: u32,
    taps: Vec<Tap>,
}

/// A pixel that can be interpolated.
pub(crate) trait Blend: Copy {
    /// What pixels without a source show.
    const BLACK: Self;

    /// The weighted sum; the weights add up to `WEIGHT_ONE^2`.
    fn blend(corners: [Self; 4], weights: [u32; 4]) -> Self;
}

impl Blend for u8 {
    const BLACK: Self = 0;

    fn blend([a, b, c, d]: [Self; 4], weights: [u32; 4]) -> Self {
        let sum = u32::from(a) * weights[0]
            + u32::from(b) * weights[1]
            + u32::from(c) * weights[2]
            + u32::from(d) * weights[3];
        ((sum + HALF) / (WEIGHT_ONE * WEIGHT_ONE)) as u8
    }
}

impl Blend for [u8; 3] {
    const BLACK: Self = [0; 3];

    fn blend(corners: [Self; 4], weights: [u32; 4]) -> Self {
        std::array::from_fn(|channel| u8::blend(corners.map(|corner| corner[channel]), weights))
    }
}

impl RemapTable {
    /// Tabulates `source_pixel`, the place in the source of each output pixel.
    pub(crate) fn new(
        (width_px, height_px): (u32, u32),
        source_pixel: impl Fn(&Point2<f64>) -> Option<Point2<f64>>,
    ) -> Self {
        let mut taps = Vec::with_capacity(width_px as usize * height_px as usize);
        for y in 0..height_px {
            for x in 0..width_px {
                let output = Point2::new(f64::from(x), f64::from(y));
                taps.push(tap(source_pixel(&output), width_px, height_px));
            }
        }
        Self { width_px, taps }
    }

    /// Resamples bilinearly; pixels without a source are black. `source` must have the table's size.
    pub(crate) fn bilinear<T: Blend>(&self, source: &Raster<T>) -> Raster<T> {
        let pixels = source.pixels();
        let stride = self.width_px as usize;
        self.per_tap(|tap| {
            let first = tap.top_left as usize;
            let corners =
                [pixels[first], pixels[first + 1], pixels[first + stride], pixels[first + stride + 1]];
            let (right, bottom) = (u32::from(tap.right), u32::from(tap.bottom));
            let (left, top) = (WEIGHT_ONE - right, WEIGHT_ONE - bottom);
            T::blend(corners, [left * top, right * top, left * bottom, right * bottom])
        })
        .map(|pixel| pixel.unwrap_or(T::BLACK))
    }

    /// Resamples to the nearest pixel, for labels; pixels without a source are covered.
    pub(crate) fn nearest(&self, source: &Mask) -> Mask {
        let pixels = source.pixels();
        let half = WEIGHT_ONE as u16 / 2;
        self.per_tap(|tap| {
            let column = usize::from(tap.right >= half);
            let row = usize::from(tap.bottom >= half);
            pixels[tap.top_left as usize + column + row * self.width_px as usize]
        })
        .map(|pixel| pixel.unwrap_or(COVERED))
    }

    /// Covers the pixels that have no source.
    pub(crate) fn blind(&self) -> Mask {
        self.per_tap(|_| 0).map(|pixel| pixel.unwrap_or(COVERED))
    }

    fn per_tap<T>(&self, mut value: impl FnMut(&Tap) -> T) -> Raster<Option<T>> {
        let height_px = self.taps.len() as u32 / self.width_px;
        let mut taps = self.taps.iter();
        Raster::from_fn(self.width_px, height_px, |_, _| {
            taps.next().filter(|tap| tap.top_left != OUTSIDE).map(&mut value)
        })
    }
}

/// The tap of a source place; outside unless all four pixels around it exist.
fn tap(source: Option<Point2<f64>>, width_px: u32, height_px: u32) -> Tap {
    let outside = Tap { top_left: OUTSIDE, right: 0, bottom: 0 };
    let Some(source) = source else { return outside };
    let (Some((x, right)), Some((y, bottom))) = (split(source.x, width_px), split(source.y, height_px))
    else {
        return outside;
    };
    Tap { top_left: y * width_px + x, right, bottom }
}

/// A coordinate as the pixel before it and the weight of the pixel after it; rounds onto the edge.
fn split(coordinate_px: f64, side_px: u32) -> Option<(u32, u16)> {
    let last = side_px - 1;
    let slack_px = 0.5 / f64::from(WEIGHT_ONE);
    if last == 0 || !(-slack_px..=f64::from(last) + slack_px).contains(&coordinate_px) {
        return None;
    }
    let coordinate_px = coordinate_px.clamp(0.0, f64::from(last));
    let before = (coordinate_px as u32).min(last - 1);
    let weight = (coordinate_px - f64::from(before)) * f64::from(WEIGHT_ONE);
    Some((before, weight.round() as u16))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_identity_changes_nothing_and_covers_nothing() {
        let image = Raster::from_fn(7, 5, |x, y| (x * 31 + y * 17) as u8);
        let table = RemapTable::new(image.size(), |pixel| Some(*pixel));
        assert_eq!(table.bilinear(&image), image);
        assert_eq!(table.blind(), Raster::filled(7, 5, 0));
    }

    #[test]
    fn a_half_pixel_shift_averages_neighbours_and_loses_the_last_column() {
        let image = Raster::from_fn(4, 2, |x, _| [10 * x as u8, 0, 255]);
        let table = RemapTable::new(image.size(), |pixel| Some(Point2::new(pixel.x + 0.5, pixel.y)));
        let shifted = table.bilinear(&image);
        assert_eq!(shifted.row(1), [[5, 0, 255], [15, 0, 255], [25, 0, 255], [0, 0, 0]]);
        assert_eq!(table.blind().row(0), [0, 0, 0, COVERED]);
    }

    #[test]
    fn a_mask_keeps_its_labels_and_covers_what_was_not_seen() {
        let mask = Raster::from_fn(4, 2, |x, _| if x == 2 { 7 } else { 0 });
        let table = RemapTable::new(mask.size(), |pixel| Some(Point2::new(pixel.x + 0.7, pixel.y)));
        assert_eq!(table.nearest(&mask).row(0), [0, 7, 0, COVERED]);
    }

    #[test]
    fn places_that_are_not_numbers_are_outside() {
        let table = RemapTable::new((3, 3), |_| Some(Point2::new(f64::NAN, 1.0)));
        assert_eq!(table.blind(), Raster::filled(3, 3, COVERED));
    }
}
