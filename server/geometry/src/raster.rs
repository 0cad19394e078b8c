//! Row-major images of any pixel type.

use crate::GeometryError;

/// A row-major image; pixel centres are at integer coordinates, `(0, 0)` is the top left one.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster<T> {
    width: u32,
    height: u32,
    data: Vec<T>,
}

/// 8-bit luminance.
pub type Gray = Raster<u8>;
/// 8-bit sRGB, three bytes a pixel.
pub type Rgb = Raster<[u8; 3]>;
/// Depth along the optical axis in metres, `0.0` where unknown.
pub type DepthMap = Raster<f32>;
/// Instrument or validity mask, `0` where tissue is seen, anything else where it is covered.
pub type Mask = Raster<u8>;

impl<T: Copy> Raster<T> {
    /// An image of one value.
    pub fn filled(width: u32, height: u32, value: T) -> Self {
        Self { width, height, data: vec![value; width as usize * height as usize] }
    }
}

impl<T> Raster<T> {
    /// Wraps `data`, `width * height` pixels in row order.
    ///
    /// # Errors
    /// [`GeometryError::RasterSize`] where the length does not fit.
    pub fn from_vec(width: u32, height: u32, data: Vec<T>) -> Result<Self, GeometryError> {
        let expected = width as usize * height as usize;
        if data.len() != expected {
            return Err(GeometryError::RasterSize { width, height, pixels: data.len() });
        }
        Ok(Self { width, height, data })
    }

    /// An image computed pixel by pixel from `(x, y)`.
    pub fn from_fn(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> T) -> Self {
        let mut data = Vec::with_capacity(width as usize * height as usize);
        for y in 0..height {
            data.extend((0..width).map(|x| pixel(x, y)));
        }
        Self { width, height, data }
    }

    /// The image with `f` applied to each pixel.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Raster<U> {
        Raster { width: self.width, height: self.height, data: self.data.iter().map(f).collect() }
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// `(width, height)`.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// All pixels in row order.
    pub fn pixels(&self) -> &[T] {
        &self.data
    }

    /// All pixels in row order.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The pixels, given away.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// Row `y`.
    pub fn row(&self, y: u32) -> &[T] {
        let start = y as usize * self.width as usize;
        &self.data[start..start + self.width as usize]
    }

    /// The pixel, or `None` outside the image.
    pub fn get(&self, x: i64, y: i64) -> Option<&T> {
        let inside = x >= 0 && y >= 0 && x < i64::from(self.width) && y < i64::from(self.height);
        inside.then(|| &self.data[y as usize * self.width as usize + x as usize])
    }
}

impl<T> std::ops::Index<(u32, u32)> for Raster<T> {
    type Output = T;

    fn index(&self, (x, y): (u32, u32)) -> &T {
        debug_assert!(x < self.width, "column {x} of {}", self.width);
        &self.data[y as usize * self.width as usize + x as usize]
    }
}

impl<T> std::ops::IndexMut<(u32, u32)> for Raster<T> {
    fn index_mut(&mut self, (x, y): (u32, u32)) -> &mut T {
        debug_assert!(x < self.width, "column {x} of {}", self.width);
        &mut self.data[y as usize * self.width as usize + x as usize]
    }
}

impl Rgb {
    /// Row `y` of the result is what lies `offset_px` below row `y` here, blended from two rows; black beyond the image.
    #[must_use]
    pub fn rows_shifted(&self, offset_px: f64) -> Self {
        let whole = offset_px.floor();
        let share = ((offset_px - whole) * 256.0).round() as u32;
        let black = vec![[0; 3]; self.width() as usize];
        let row = |y: i64| {
            u32::try_from(y).ok().filter(|&y| y < self.height()).map_or(black.as_slice(), |y| self.row(y))
        };
        let mut data = Vec::with_capacity(self.pixels().len());
        for y in 0..i64::from(self.height()) {
            let (upper, lower) = (row(y + whole as i64), row(y + whole as i64 + 1));
            data.extend(upper.iter().zip(lower).map(|(above, below)| blend(*above, *below, share)));
        }
        Self { width: self.width, height: self.height, data }
    }

    /// Luminance by Rec. 601 in 8-bit fixed point, as OpenCV's `RGB2GRAY`.
    pub fn to_gray(&self) -> Gray {
        self.map(|&[r, g, b]| {
            ((u32::from(r) * 4899 + u32::from(g) * 9617 + u32::from(b) * 1868 + (1 << 13)) >> 14) as u8
        })
    }
}

impl Raster<u8> {
    /// The value between pixels, or `None` outside the pixel centres.
    pub fn bilinear(&self, x: f32, y: f32) -> Option<f32> {
        let (last_x, last_y) = (self.width.checked_sub(1)?, self.height.checked_sub(1)?);
        if !((0.0..=last_x as f32).contains(&x) && (0.0..=last_y as f32).contains(&y)) {
            return None;
        }
        let (left, top) = (x as u32, y as u32);
        let (right, bottom) = ((left + 1).min(last_x), (top + 1).min(last_y));
        let (along_x, along_y) = (x - left as f32, y - top as f32);
        let between = |row: &[u8]| {
            let (a, b) = (f32::from(row[left as usize]), f32::from(row[right as usize]));
            a + (b - a) * along_x
        };
        let (upper, lower) = (between(self.row(top)), between(self.row(bottom)));
        Some(upper + (lower - upper) * along_y)
    }
}

/// `share` of 256 from `b`.
fn blend(a: [u8; 3], b: [u8; 3], share: u32) -> [u8; 3] {
    std::array::from_fn(|k| ((u32::from(a[k]) * (256 - share) + u32::from(b[k]) * share + 128) >> 8) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_between_pixels_are_interpolated() {
        let image = Gray::from_vec(2, 2, vec![0, 100, 50, 250]).expect("four pixels");
        assert_eq!(image.bilinear(0.25, 0.0), Some(25.0));
        assert_eq!(image.bilinear(0.5, 0.5), Some(100.0));
        assert_eq!(image.bilinear(1.0, 1.0), Some(250.0));
    }

    #[test]
    fn there_is_no_value_outside_the_pixel_centres() {
        let image = Gray::filled(2, 2, 9);
        for (x, y) in [(-0.1, 0.0), (1.1, 0.0), (0.0, 1.1), (f32::NAN, 0.0)] {
            assert_eq!(image.bilinear(x, y), None, "({x}, {y})");
        }
        assert_eq!(Gray::filled(0, 0, 0).bilinear(0.0, 0.0), None);
    }

    #[test]
    fn pixels_that_do_not_fill_the_image_are_refused() {
        let error = Gray::from_vec(3, 2, vec![0; 5]).expect_err("one is missing");
        assert_eq!(error.to_string(), "an image of 3x2 needs 6 pixels, got 5");
    }

    #[test]
    fn shifted_rows_blend_and_end_in_black() {
        let image = Rgb::from_fn(2, 4, |_, y| [40 * (y as u8 + 1); 3]);
        let levels = |image: &Rgb| (0..4).map(|y| image[(1, y)][0]).collect::<Vec<_>>();
        assert_eq!(levels(&image.rows_shifted(0.0)), [40, 80, 120, 160]);
        assert_eq!(levels(&image.rows_shifted(1.5)), [100, 140, 80, 0]);
        assert_eq!(levels(&image.rows_shifted(-1.0)), [0, 40, 80, 120]);
        assert_eq!(levels(&image.rows_shifted(-9.0)), [0; 4]);
    }
}
