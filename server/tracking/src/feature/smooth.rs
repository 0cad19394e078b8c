//! Gaussian smoothing before the descriptor's point comparisons.

use geometry::{Gray, Raster};

use crate::dispatch::dispatch;

/// Gaussian of sigma 2 px over 7 taps; sums to 256.
const KERNEL: [u16; 7] = [18, 33, 49, 56, 49, 33, 18];
const RADIUS: usize = 3;

dispatch! {
    /// The image smoothed with a separable 7x7 Gaussian (sigma 2 px); pixels outside repeat the border.
    pub fn gaussian_7x7(image: &Gray) -> Gray = gaussian_7x7_portable;
}

#[inline(always)]
fn gaussian_7x7_portable(image: &Gray) -> Gray {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut vertical = vec![0_u8; width + 2 * RADIUS];
    let mut target: Gray = Raster::filled(image.width(), image.height(), 0);
    if width == 0 || height == 0 {
        return target;
    }
    for (y, out) in target.pixels_mut().chunks_exact_mut(width).enumerate() {
        let rows: [&[u8]; 7] =
            std::array::from_fn(|tap| image.row((y + tap).saturating_sub(RADIUS).min(height - 1) as u32));
        weigh(rows, &mut vertical[RADIUS..RADIUS + width]);
        let (first, last) = (vertical[RADIUS], vertical[RADIUS + width - 1]);
        vertical[..RADIUS].fill(first);
        vertical[RADIUS + width..].fill(last);
        weigh(std::array::from_fn(|tap| &vertical[tap..tap + width]), out);
    }
    target
}

/// Weighted sum of seven equally long rows. 255 * 256 fits 16 bits, so the wrapping arithmetic never wraps; it is
/// there because checked arithmetic would keep the loop from being vectorised.
#[inline(always)]
fn weigh(rows: [&[u8]; 7], out: &mut [u8]) {
    let length = out.len();
    let rows = rows.map(|row| &row[..length]);
    for (i, pixel) in out.iter_mut().enumerate() {
        let mut sum = 128_u16;
        for (row, weight) in rows.iter().zip(KERNEL) {
            sum = sum.wrapping_add(u16::from(row[i]).wrapping_mul(weight));
        }
        *pixel = (sum >> 8) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_image_is_unchanged() {
        for value in [0, 1, 128, 255] {
            let smooth = gaussian_7x7(&Raster::filled(33, 9, value));
            assert!(smooth.pixels().iter().all(|&pixel| pixel == value));
        }
    }

    #[test]
    fn an_impulse_becomes_the_kernel() {
        let mut image = Raster::filled(15, 15, 0);
        image[(7, 7)] = 255;
        let smooth = gaussian_7x7(&image);
        for dy in 0..7 {
            for dx in 0..7 {
                let expected = 255.0 / 65536.0 * f32::from(KERNEL[dx]) * f32::from(KERNEL[dy]);
                let got = f32::from(smooth[(4 + dx as u32, 4 + dy as u32)]);
                assert!((got - expected).abs() <= 1.0, "({dx}, {dy}): {got}, not {expected}");
            }
        }
    }
}
