//! Corner orientation by the intensity centroid (Rosin 1999; Rublee et al. 2011, section 3.2).

use geometry::Gray;

use crate::dispatch::dispatch;

/// Radius of the disc whose moments are taken.
pub const RADIUS_PX: i32 = 15;

/// Half widths of the disc's rows, by `|dy|`: the largest `dx` with `dx^2 + dy^2 <= (RADIUS_PX + 1/2)^2`.
const HALF_WIDTHS: [i32; 16] = half_widths();

const fn half_widths() -> [i32; 16] {
    let mut widths = [0; 16];
    let limit = RADIUS_PX * RADIUS_PX + RADIUS_PX;
    let mut dy = 0;
    while dy <= RADIUS_PX {
        let mut dx = 0;
        while (dx + 1) * (dx + 1) + dy * dy <= limit {
            dx += 1;
        }
        widths[dy as usize] = dx;
        dy += 1;
    }
    widths
}

/// A row of the disc and one pixel more, for whole vectors.
const ROW: usize = 2 * RADIUS_PX as usize + 2;

/// For each row of the disc: 1 inside it, and `dx` inside it.
static ROW_WEIGHTS: [[[i16; ROW]; 2]; 2 * RADIUS_PX as usize + 1] = row_weights();

const fn row_weights() -> [[[i16; ROW]; 2]; 2 * RADIUS_PX as usize + 1] {
    let mut weights = [[[0; ROW]; 2]; 2 * RADIUS_PX as usize + 1];
    let mut row = 0;
    while row < weights.len() {
        let half_width = HALF_WIDTHS[(row as i32 - RADIUS_PX).unsigned_abs() as usize];
        let mut dx = -half_width;
        while dx <= half_width {
            let column = (dx + RADIUS_PX) as usize;
            weights[row][0][column] = 1;
            weights[row][1][column] = dx as i16;
            dx += 1;
        }
        row += 1;
    }
    weights
}

dispatch! {
    /// Angle `atan2(m01, m10)` of the first moments over the disc around `(x, y)`, which must lie more than
    /// [`RADIUS_PX`] from the image border.
    pub fn angle_rad(image: &Gray, x: u32, y: u32) -> f32 = angle_rad_portable;
}

#[inline(always)]
fn angle_rad_portable(image: &Gray, x: u32, y: u32) -> f32 {
    let (mut m10, mut m01) = (0_i32, 0_i32);
    let left = x as usize - RADIUS_PX as usize;
    for (row, [inside, offsets]) in ROW_WEIGHTS.iter().enumerate() {
        let dy = row as i32 - RADIUS_PX;
        let pixels = &image.row((y as i32 + dy) as u32)[left..left + ROW];
        let (mut sum, mut moment) = (0_i32, 0_i32);
        for ((&value, &inside), &dx) in pixels.iter().zip(inside).zip(offsets) {
            // at most 709 pixels of 255 at 15: far from overflow
            let value = i32::from(value);
            sum = sum.wrapping_add(value.wrapping_mul(i32::from(inside)));
            moment = moment.wrapping_add(value.wrapping_mul(i32::from(dx)));
        }
        m10 += moment;
        m01 += dy * sum;
    }
    (m01 as f32).atan2(m10 as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Raster;

    #[test]
    fn the_angle_follows_the_direction_of_a_gradient() {
        for step in 0..24 {
            let angle = (step as f32 * 15.0 - 172.0).to_radians();
            let (sin, cos) = angle.sin_cos();
            let ramp = |x: u32, y: u32| (x as f32 - 20.0) * cos + (y as f32 - 20.0) * sin;
            let image = Raster::from_fn(41, 41, |x, y| (128.0 + 5.0 * ramp(x, y)).clamp(0.0, 255.0) as u8);
            let error = (angle_rad(&image, 20, 20) - angle).to_degrees();
            assert!(error.abs() < 1.5, "{error} degrees at {} degrees", angle.to_degrees());
        }
    }

    #[test]
    fn moments_are_those_of_the_disc_pixel_by_pixel() {
        let image = Raster::from_fn(33, 32, |x, y| ((x * 37) ^ (y * 91)) as u8);
        let (mut m10, mut m01) = (0_i64, 0_i64);
        for (dx, dy) in (-15..=15_i64).flat_map(|dy| (-15..=15_i64).map(move |dx| (dx, dy))) {
            if dx * dx + dy * dy <= 15 * 15 + 15 {
                let value = i64::from(*image.get(16 + dx, 16 + dy).expect("inside"));
                m10 += dx * value;
                m01 += dy * value;
            }
        }
        assert_eq!(angle_rad(&image, 16, 16), (m01 as f32).atan2(m10 as f32));
    }

    #[test]
    fn the_disc_is_round() {
        assert_eq!(HALF_WIDTHS[0], 15);
        assert_eq!(HALF_WIDTHS[11], 10);
        assert_eq!(HALF_WIDTHS[15], 3);
    }
}
