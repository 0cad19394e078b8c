//! Sub-pixel disparity: windows around a left corner and along the right row are compared on the corner's pyramid
//! level by the sum of absolute differences after removal of their means. Around its minimum such a sum falls and rises
//! linearly, so two lines of equal and opposite slope through the best three sums give the fraction (a parabola is biased).

use geometry::Gray;

use crate::dispatch::dispatch;

/// Window radius at most; windows live on the stack.
pub const MAX_RADIUS: usize = 7;
/// Search radius at most.
pub const MAX_SEARCH: usize = 8;
const MAX_SIDE: usize = 2 * MAX_RADIUS + 1;
/// A window's row, filled up to a whole vector.
const LANES: usize = 16;
/// Window plus the search to both sides, and the filling.
const MAX_STRIP: usize = LANES + 2 * MAX_SEARCH;

/// Radii of comparison, px of the level, at most [`MAX_RADIUS`] and [`MAX_SEARCH`].
#[derive(Clone, Copy, Debug)]
pub struct Windows {
    /// Half side of a window.
    pub radius: usize,
    /// Search to both sides.
    pub search: usize,
}

/// Where a window was found again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// Column on the right level image, with its fraction.
    pub x: f32,
    /// Mean absolute difference, grey levels.
    pub difference: f32,
}

/// Finds the window around `(x, y)` of `left` near `(right_x, right_y)` of `right`, rows `right_y - 1..=right_y + 1`.
///
/// `None` where a window leaves an image or the best place is the end of the search.
pub fn refine(
    left: &Gray,
    (x, y): (i32, i32),
    right: &Gray,
    (right_x, right_y): (i32, i32),
    windows: Windows,
) -> Option<Refined> {
    let reach = (windows.radius + windows.search) as i32;
    let inside = |image: &Gray, x: i32, y: i32, reach_x: i32, reach_y: i32| {
        x >= reach_x
            && y >= reach_y
            && x + reach_x < image.width() as i32
            && y + reach_y < image.height() as i32
    };
    let radius = windows.radius as i32;
    if !inside(left, x, y, radius, radius) || !inside(right, right_x, right_y, reach, radius + 1) {
        return None;
    }
    let template = Template::cut(left, x, y, windows.radius);
    let row_sums = |row: i32| template.differences(right, right_x, row, windows.search);
    let (sums, best) = [right_y, right_y - 1, right_y + 1]
        .map(|row| {
            let sums = row_sums(row);
            let best = (0..=2 * windows.search).min_by_key(|&step| sums[step]).unwrap_or(0);
            (sums, best)
        })
        .into_iter()
        .min_by_key(|(sums, best)| sums[*best])?;
    if best == 0 || best == 2 * windows.search {
        return None;
    }
    let [before, at, after] = [sums[best - 1], sums[best], sums[best + 1]].map(|sum| sum as f32);
    let slope = before.max(after) - at;
    let fraction = if slope > 0.0 { 0.5 * (before - after) / slope } else { 0.0 };
    let area = ((2 * windows.radius + 1) * (2 * windows.radius + 1)) as f32;
    let x = (right_x + best as i32 - windows.search as i32) as f32 + fraction;
    Some(Refined { x, difference: at / area })
}

/// A window with its mean removed, zero beyond its side.
struct Template {
    rows: [[i16; LANES]; MAX_SIDE],
    radius: usize,
}

impl Template {
    fn cut(image: &Gray, x: i32, y: i32, radius: usize) -> Self {
        let side = 2 * radius + 1;
        let mut rows = [[0; LANES]; MAX_SIDE];
        let mut sum = 0_i32;
        for (offset, row) in rows.iter_mut().enumerate().take(side) {
            let start = x as usize - radius;
            let source = &image.row((y as usize + offset - radius) as u32)[start..start + side];
            for (target, &value) in row.iter_mut().zip(source) {
                *target = i16::from(value);
                sum += i32::from(value);
            }
        }
        let mean = rounded_mean(sum, side);
        for value in rows.iter_mut().take(side).flat_map(|row| &mut row[..side]) {
            *value -= mean;
        }
        Self { rows, radius }
    }

    /// Sums of absolute differences with the windows centred at `x - search ..= x + search` of row `y`.
    fn differences(&self, image: &Gray, x: i32, y: i32, search: usize) -> [i32; 2 * MAX_SEARCH + 1] {
        let side = 2 * self.radius + 1;
        let width = side + 2 * search;
        let start = x as usize - self.radius - search;
        let mut strip = [[0_i16; MAX_STRIP]; MAX_SIDE];
        let mut column_sums = [0_i32; MAX_STRIP];
        for (offset, row) in strip.iter_mut().enumerate().take(side) {
            let source = &image.row((y as usize + offset - self.radius) as u32)[start..start + width];
            for ((target, sum), &value) in row.iter_mut().zip(&mut column_sums).zip(source) {
                *target = i16::from(value);
                *sum = sum.wrapping_add(i32::from(value));
            }
        }
        let mut sums = [0; 2 * MAX_SEARCH + 1];
        for (step, total) in sums.iter_mut().enumerate().take(2 * search + 1) {
            let mean = rounded_mean(column_sums[step..step + side].iter().sum(), side);
            *total = difference(&self.rows[..side], &strip[..side], step, mean);
        }
        sums
    }
}

dispatch! {
    /// Sum of `|template - (window - mean)|` over the window that begins at column `step` of the strip.
    ///
    /// Values stay within +-510, 15 of them in a column: sixteen bits cannot overflow, and wrapping sums are vectorised.
    fn difference(template: &[[i16; LANES]], strip: &[[i16; MAX_STRIP]], step: usize, mean: i16) -> i32 = difference_portable;
}

#[inline(always)]
fn difference_portable(template: &[[i16; LANES]], strip: &[[i16; MAX_STRIP]], step: usize, mean: i16) -> i32 {
    let mut columns = [0_i16; LANES];
    for (row, other) in template.iter().zip(strip) {
        let other: &[i16; LANES] = other[step..step + LANES].try_into().expect("a slice of LANES values");
        for i in 0..LANES {
            let difference = row[i].wrapping_sub(other[i]).wrapping_add(mean);
            columns[i] = columns[i].wrapping_add(difference.wrapping_abs());
        }
    }
    columns[..template.len()].iter().map(|&sum| i32::from(sum)).sum()
}

fn rounded_mean(sum: i32, side: usize) -> i16 {
    let area = (side * side) as i32;
    ((sum + area / 2) / area) as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Raster;

    const WINDOWS: Windows = Windows { radius: 5, search: 5 };

    fn texture(x: f32, y: f32) -> f32 {
        128.0 + 40.0 * (0.35 * x + 0.1 * y).sin() + 30.0 * (0.21 * x - 0.3 * y).cos() + 20.0 * (0.5 * y).sin()
    }

    fn shifted(shift: f32, rows: f32, gain: f32) -> Gray {
        Raster::from_fn(120, 60, |x, y| {
            (gain * texture(x as f32 + shift, y as f32 + rows)).clamp(0.0, 255.0) as u8
        })
    }

    #[test]
    fn fractions_of_a_shift_are_found_to_a_tenth_of_a_pixel() {
        let left = shifted(0.0, 0.0, 1.0);
        for step in 0..20 {
            let shift = 8.0 + step as f32 * 0.1;
            let right = shifted(shift, 0.0, 1.0);
            let refined = refine(&left, (60, 30), &right, (51, 30), WINDOWS).expect("a match");
            let error = 60.0 - refined.x - shift;
            assert!(error.abs() < 0.1, "{error} px at {shift}");
        }
    }

    #[test]
    fn a_row_of_misalignment_and_a_brightness_offset_do_no_harm() {
        let left = shifted(0.0, 0.0, 0.8);
        let brighter = shifted(9.3, 1.0, 0.8).map(|value| value.saturating_add(25));
        let refined = refine(&left, (60, 30), &brighter, (51, 30), WINDOWS).expect("a match");
        assert!((60.0 - refined.x - 9.3).abs() < 0.1, "{refined:?}");
        assert!(refined.difference < 4.0, "{refined:?}");
    }

    #[test]
    fn sums_are_those_of_the_definition() {
        let (left, right) = (shifted(0.0, 0.0, 1.0), shifted(8.4, 0.3, 0.9));
        for radius in 2..=MAX_RADIUS {
            let side = 2 * radius as i64 + 1;
            let window = |image: &Gray, x: i64, y: i64| -> Vec<i32> {
                let half = radius as i64;
                let places = (-half..=half).flat_map(|dy| (-half..=half).map(move |dx| (x + dx, y + dy)));
                let values: Vec<i32> =
                    places.map(|(x, y)| i32::from(*image.get(x, y).expect("inside"))).collect();
                let mean = i32::from(rounded_mean(values.iter().sum(), side as usize));
                values.iter().map(|value| value - mean).collect()
            };
            let template = window(&left, 60, 30);
            let sums = Template::cut(&left, 60, 30, radius).differences(&right, 52, 30, MAX_SEARCH);
            for (step, &sum) in sums.iter().enumerate() {
                let other = window(&right, 52 + step as i64 - MAX_SEARCH as i64, 30);
                let expected: i32 = template.iter().zip(&other).map(|(a, b)| (a - b).abs()).sum();
                assert_eq!(sum, expected, "radius {radius}, step {step}");
            }
        }
    }

    #[test]
    fn windows_that_leave_the_image_and_ends_of_the_search_are_refused() {
        let left = shifted(0.0, 0.0, 1.0);
        let right = shifted(8.0, 0.0, 1.0);
        assert_eq!(refine(&left, (60, 30), &right, (9, 30), WINDOWS), None);
        assert_eq!(refine(&left, (60, 2), &right, (52, 30), WINDOWS), None);
        assert_eq!(refine(&left, (60, 30), &right, (60 - 8 + 5, 30), WINDOWS), None);
    }
}
