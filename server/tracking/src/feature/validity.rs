//! Where features may be: not on highlights, not at the black frame of the useful area, not on instruments.
//!
//! Highlights move with the lamp, the frame with the camera: corners there are strong, sharp and wrong. The map keeps
//! the distance to the nearest invalid pixel in cells of 4x4, so that coarse levels stay further away.

use geometry::{Gray, Mask};

use crate::config::MaskConfig;

const CELL_PX: usize = 4;

/// Distance (chessboard, in cells, saturated) of each 4x4 cell to the nearest invalid pixel's cell.
#[derive(Clone, Debug)]
pub struct ValidityMap {
    columns: usize,
    distance_cells: Vec<u8>,
    margin_px: f32,
}

impl ValidityMap {
    /// Finds saturated pixels and the dark border of an image; `mask` (same size) covers more where not zero.
    pub fn new(image: &Gray, mask: Option<&Mask>, config: &MaskConfig) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let (columns, rows) = (width.div_ceil(CELL_PX), height.div_ceil(CELL_PX));
        let mut map =
            Self { columns, distance_cells: vec![u8::MAX; columns * rows], margin_px: config.margin_px };
        map.mark_where(image, |value| value >= config.specular_level);
        if let Some(mask) = mask {
            map.mark_where(mask, |value| value != 0);
        }
        map.mark_dark_border(image, config.black_level);
        map.spread();
        map
    }

    /// Whether a keypoint of a level of the given scale may lie at a full-size pixel inside the image.
    pub fn allows(&self, x_px: f32, y_px: f32, scale: f32) -> bool {
        let cell = y_px as usize / CELL_PX * self.columns + x_px as usize / CELL_PX;
        f32::from(self.distance_cells[cell]) * CELL_PX as f32 > self.margin_px * scale
    }

    fn mark_where(&mut self, image: &Gray, invalid: impl Fn(u8) -> bool) {
        for y in 0..image.height() {
            let cells = &mut self.distance_cells[y as usize / CELL_PX * self.columns..][..self.columns];
            for (cell, pixels) in cells.iter_mut().zip(image.row(y).chunks(CELL_PX)) {
                if pixels.iter().any(|&value| invalid(value)) {
                    *cell = 0;
                }
            }
        }
    }

    /// From each side inwards along rows and columns, up to the first pixel that is not black.
    fn mark_dark_border(&mut self, image: &Gray, black_level: u8) {
        let (width, height) = (image.width() as usize, image.height() as usize);
        for y in 0..height {
            let row = image.row(y as u32);
            let left = row.iter().take_while(|&&value| value <= black_level).count();
            let right = row.iter().rev().take_while(|&&value| value <= black_level).count();
            self.mark_run(left, |x| (x, y));
            self.mark_run(right, |x| (width - 1 - x, y));
        }
        let black = |x: usize, y: usize| image.pixels()[y * width + x] <= black_level;
        for x in 0..width {
            let top = (0..height).take_while(|&y| black(x, y)).count();
            let bottom = (0..height).rev().take_while(|&y| black(x, y)).count();
            self.mark_run(top, |y| (x, y));
            self.mark_run(bottom, |y| (x, height - 1 - y));
        }
    }

    fn mark_run(&mut self, length: usize, pixel: impl Fn(usize) -> (usize, usize)) {
        for step in (0..length).step_by(CELL_PX).chain(length.checked_sub(1)) {
            let (x, y) = pixel(step);
            self.distance_cells[y / CELL_PX * self.columns + x / CELL_PX] = 0;
        }
    }

    /// Two-pass chessboard distance transform.
    fn spread(&mut self) {
        let columns = self.columns;
        let rows = self.distance_cells.len() / columns.max(1);
        let nearer = |cells: &[u8], best: u8, neighbour: usize| best.min(cells[neighbour].saturating_add(1));
        for index in 0..rows * columns {
            let (x, y) = (index % columns, index / columns);
            let mut best = self.distance_cells[index];
            if x > 0 {
                best = nearer(&self.distance_cells, best, index - 1);
            }
            if y > 0 {
                let above = index - columns;
                for neighbour in above - usize::from(x > 0)..=above + usize::from(x + 1 < columns) {
                    best = nearer(&self.distance_cells, best, neighbour);
                }
            }
            self.distance_cells[index] = best;
        }
        for index in (0..rows * columns).rev() {
            let (x, y) = (index % columns, index / columns);
            let mut best = self.distance_cells[index];
            if x + 1 < columns {
                best = nearer(&self.distance_cells, best, index + 1);
            }
            if y + 1 < rows {
                let below = index + columns;
                for neighbour in below - usize::from(x > 0)..=below + usize::from(x + 1 < columns) {
                    best = nearer(&self.distance_cells, best, neighbour);
                }
            }
            self.distance_cells[index] = best;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Raster;

    const CONFIG: MaskConfig = MaskConfig { specular_level: 250, black_level: 10, margin_px: 4.0 };

    #[test]
    fn tissue_is_allowed_and_black_border_highlight_and_instrument_are_not() {
        let mut image = Raster::from_fn(120, 80, |x, _| if x < 30 { 3 } else { 120 });
        image[(70, 40)] = 255;
        let mask = Raster::from_fn(120, 80, |x, y| u8::from(x > 100 && y > 60));
        let map = ValidityMap::new(&image, Some(&mask), &CONFIG);
        assert!(map.allows(50.0, 20.0, 1.0));
        assert!(!map.allows(10.0, 20.0, 1.0), "black border");
        assert!(!map.allows(32.0, 20.0, 1.0), "beside the black border");
        assert!(!map.allows(72.0, 41.0, 1.0), "highlight");
        assert!(!map.allows(110.0, 70.0, 1.0), "instrument");
    }

    #[test]
    fn coarse_levels_keep_a_wider_margin() {
        let mut image = Raster::filled(120, 80, 120);
        image[(60, 40)] = 255;
        let map = ValidityMap::new(&image, None, &CONFIG);
        assert!(map.allows(70.0, 40.0, 1.0));
        assert!(!map.allows(70.0, 40.0, 3.5));
    }

    #[test]
    fn dark_tissue_away_from_the_border_is_allowed() {
        let image =
            Raster::from_fn(
                120,
                80,
                |x, y| if (40..80).contains(&x) && (20..60).contains(&y) { 4 } else { 90 },
            );
        assert!(ValidityMap::new(&image, None, &CONFIG).allows(60.0, 40.0, 1.0));
    }

    #[test]
    fn nothing_is_allowed_on_black_or_saturated_images() {
        for value in [0, 255] {
            let map = ValidityMap::new(&Raster::filled(50, 30, value), None, &CONFIG);
            assert!((0..50).all(|x| (0..30).all(|y| !map.allows(x as f32, y as f32, 1.0))));
        }
    }
}
