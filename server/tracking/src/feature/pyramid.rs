//! Image pyramid: each level is the one below, resampled bilinearly by a constant factor.
//!
//! Levels are aligned at the image corner, so `x_0 + 0.5 = (x_l + 0.5) * scale_l` holds for pixel centres.

use geometry::{Gray, Raster};

use crate::dispatch::dispatch;

/// Fractional bits of the interpolation weights.
const WEIGHT_BITS: u32 = 7;
const WEIGHT_ONE: u32 = 1 << WEIGHT_BITS;

/// An image and its reductions, finest first.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<Gray>,
    scales: Vec<f32>,
}

impl Pyramid {
    /// Builds `levels` levels (at least the image itself), each smaller by `scale_factor` than the one before.
    pub fn build(image: &Gray, levels: u32, scale_factor: f32) -> Self {
        let mut pyramid = Self { levels: vec![image.clone()], scales: vec![1.0] };
        for level in 1..levels {
            let scale = scale_factor.powi(level as i32);
            let next =
                reduce(&pyramid.levels[level as usize - 1], level_size(image.size(), scale), scale_factor);
            pyramid.levels.push(next);
            pyramid.scales.push(scale);
        }
        pyramid
    }

    /// The images, finest first.
    pub fn levels(&self) -> &[Gray] {
        &self.levels
    }

    /// Full-size pixels per pixel of each level.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// Image of one level.
    pub fn level(&self, level: u8) -> &Gray {
        &self.levels[usize::from(level)]
    }
}

/// Full-size coordinate of a coordinate on a level of the given scale.
pub fn to_full_size(coordinate: f32, scale: f32) -> f32 {
    (coordinate + 0.5) * scale - 0.5
}

/// Coordinate on a level of the given scale of a full-size coordinate.
pub fn to_level(coordinate: f32, scale: f32) -> f32 {
    (coordinate + 0.5) / scale - 0.5
}

/// Size of a level: the full size over its scale, rounded, at least one pixel.
pub fn level_size((width, height): (u32, u32), scale: f32) -> (u32, u32) {
    let reduced = |length: u32| ((length as f32 / scale).round() as u32).max(1);
    (reduced(width), reduced(height))
}

/// Source index pair and the second one's weight.
#[derive(Clone, Copy)]
struct Tap {
    first: u32,
    second: u32,
    weight: u32,
}

fn taps(source_length: u32, target_length: u32, factor: f32) -> Vec<Tap> {
    let last = source_length - 1;
    let tap = |index: u32| {
        let source = ((index as f32 + 0.5) * factor - 0.5).clamp(0.0, last as f32);
        let first = source as u32;
        let weight = ((source - first as f32) * WEIGHT_ONE as f32).round() as u32;
        Tap { first, second: (first + 1).min(last), weight }
    };
    (0..target_length).map(tap).collect()
}

dispatch! {
    fn reduce(source: &Gray, size: (u32, u32), factor: f32) -> Gray = reduce_portable;
}

#[inline(always)]
fn reduce_portable(source: &Gray, (width, height): (u32, u32), factor: f32) -> Gray {
    let columns = taps(source.width(), width, factor);
    let rows = taps(source.height(), height, factor);
    // the last pixel twice, so that its tap has a neighbour
    let source_width = source.width() as usize;
    let mut blended = vec![0_u16; source_width + 1];
    let mut target: Gray = Raster::filled(width, height, 0);
    for (row, out) in rows.iter().zip(target.pixels_mut().chunks_exact_mut(width as usize)) {
        let pixels = &mut blended[..source_width];
        blend_rows(source.row(row.first), source.row(row.second), row.weight as u16, pixels);
        blended[source_width] = blended[source_width - 1];
        for (column, pixel) in columns.iter().zip(out) {
            *pixel = sample(&blended, column);
        }
    }
    target
}

/// `first + (second - first) * weight`, scaled by [`WEIGHT_ONE`]; fits 16 bits, so wrapping arithmetic never wraps.
#[inline(always)]
fn blend_rows(first: &[u8], second: &[u8], weight: u16, blended: &mut [u16]) {
    let rest = WEIGHT_ONE as u16 - weight;
    for ((out, &a), &b) in blended.iter_mut().zip(first).zip(second) {
        *out = u16::from(a).wrapping_mul(rest).wrapping_add(u16::from(b).wrapping_mul(weight));
    }
}

#[inline(always)]
fn sample(blended: &[u16], tap: &Tap) -> u8 {
    let [first, second] = blended[tap.first as usize..][..2] else { unreachable!("a slice of two") };
    let sum = u32::from(first) * (WEIGHT_ONE - tap.weight) + u32::from(second) * tap.weight;
    ((sum + (1 << (2 * WEIGHT_BITS - 1))) >> (2 * WEIGHT_BITS)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_levels_of_a_vga_image_have_the_published_sizes() {
        let pyramid = Pyramid::build(&Raster::filled(640, 480, 7), 8, 1.2);
        let sizes: Vec<_> = pyramid.levels().iter().map(Raster::size).collect();
        let expected =
            [(640, 480), (533, 400), (444, 333), (370, 278), (309, 231), (257, 193), (214, 161), (179, 134)];
        assert_eq!(sizes, expected);
    }

    #[test]
    fn a_ramp_stays_the_same_ramp_in_full_size_coordinates() {
        let ramp = Raster::from_fn(200, 160, |x, y| (x / 2 + y / 2) as u8);
        let pyramid = Pyramid::build(&ramp, 5, 1.2);
        for (image, &scale) in pyramid.levels().iter().zip(pyramid.scales()) {
            for y in 4..image.height() - 4 {
                for x in 4..image.width() - 4 {
                    let expected = 0.5 * (to_full_size(x as f32, scale) + to_full_size(y as f32, scale));
                    let got = f32::from(image[(x, y)]);
                    assert!((got - expected).abs() < 2.0, "scale {scale} ({x}, {y}): {got}, not {expected}");
                }
            }
        }
    }

    #[test]
    fn level_coordinates_map_back_to_themselves() {
        for scale in [1.0, 1.2, 3.583] {
            assert!((to_level(to_full_size(12.25, scale), scale) - 12.25).abs() < 1e-5);
        }
    }

    #[test]
    fn a_one_pixel_image_has_levels_of_one_pixel() {
        let pyramid = Pyramid::build(&Raster::filled(1, 1, 9), 8, 1.2);
        assert!(pyramid.levels().iter().all(|level| level.size() == (1, 1) && level[(0, 0)] == 9));
    }
}
