//! Corner orientation by the intensity centroid (Rosin 1999; Rublee et al. 2011, section 3.2).

use geometry::Gray;

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

/// Angle `atan2(m01, m10)` of the first moments over the disc around `(x, y)`, which must lie
/// [`RADIUS_PX`] or more from the image border.
pub fn angle_rad(image: &Gray, x: u32, y: u32) -> f32 {
    let (mut m10, mut m01) = (0_i32, 0_i32);
    for dy in -RADIUS_PX..=RADIUS_PX {
        let half_width = HALF_WIDTHS[dy.unsigned_abs() as usize];
        let row = image.row((y as i32 + dy) as u32);
        let start = (x as i32 - half_width) as usize;
        let (mut sum, mut moment) = (0_i32, 0_i32);
        let mut dx = -half_width;
        for &value in &row[start..=start + 2 * half_width as usize] {
            // at most 709 pixels of 255 at 15: far from overflow
            sum = sum.wrapping_add(i32::from(value));
            moment = moment.wrapping_add(dx.wrapping_mul(i32::from(value)));
            dx = dx.wrapping_add(1);
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
    fn the_disc_is_round() {
        assert_eq!(HALF_WIDTHS[0], 15);
        assert_eq!(HALF_WIDTHS[11], 10);
        assert_eq!(HALF_WIDTHS[15], 3);
    }
}
