//! Keypoints bucketed in square cells, for searches in a window.

use nalgebra::Point2;

use super::Keypoint;

const CELL_PX: f32 = 16.0;

/// Indices of keypoints by cell, cells in row order.
#[derive(Clone, Debug)]
pub struct FeatureGrid {
    columns: usize,
    rows: usize,
    /// Start of each cell in `indices`, and the end of the last.
    starts: Vec<u32>,
    indices: Vec<u32>,
}

impl FeatureGrid {
    /// Sorts the keypoints of an image of the given size into cells.
    pub fn new(keypoints: &[Keypoint], (width, height): (u32, u32)) -> Self {
        let columns = (width as f32 / CELL_PX).ceil().max(1.0) as usize;
        let rows = (height as f32 / CELL_PX).ceil().max(1.0) as usize;
        let cell = |keypoint: &Keypoint| {
            let x = (keypoint.pixel.x / CELL_PX) as usize;
            let y = (keypoint.pixel.y / CELL_PX) as usize;
            y.min(rows - 1) * columns + x.min(columns - 1)
        };
        let mut starts = vec![0; columns * rows + 1];
        for keypoint in keypoints {
            starts[cell(keypoint) + 1] += 1;
        }
        for index in 1..starts.len() {
            starts[index] += starts[index - 1];
        }
        let mut indices: Vec<u32> = (0..keypoints.len() as u32).collect();
        indices.sort_by_key(|&index| cell(&keypoints[index as usize]));
        Self { columns, rows, starts, indices }
    }

    /// Candidates within `radius_px` in x and y of a pixel: a superset, by whole cells.
    pub fn near(&self, pixel: &Point2<f32>, radius_px: f32) -> impl Iterator<Item = usize> {
        let span = |centre: f32, cells: usize| {
            let first = ((centre - radius_px) / CELL_PX).floor().max(0.0) as usize;
            let last = ((centre + radius_px) / CELL_PX).floor();
            let end = if last < 0.0 { 0 } else { (last as usize).saturating_add(1).min(cells) };
            first.min(end)..end
        };
        let columns = span(pixel.x, self.columns);
        span(pixel.y, self.rows).flat_map(move |row| {
            let start = self.starts[row * self.columns + columns.start] as usize;
            let end = self.starts[row * self.columns + columns.end] as usize;
            self.indices[start..end].iter().map(|&index| index as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn every_keypoint_in_the_window_is_found_wherever_the_window_lies() {
        let mut random = Pcg64Mcg::new(11);
        let keypoints: Vec<Keypoint> = (0..500)
            .map(|_| Point2::new(random.random_range(-0.5..639.5), random.random_range(-0.5..479.5)))
            .map(|pixel| Keypoint { pixel, level: 0, angle_rad: 0.0, score: 1 })
            .collect();
        let grid = FeatureGrid::new(&keypoints, (640, 480));
        for _ in 0..200 {
            let pixel = Point2::new(random.random_range(-100.0..740.0), random.random_range(-100.0..580.0));
            let radius = random.random_range(0.0..120.0);
            let near: Vec<usize> = grid.near(&pixel, radius).collect();
            for (index, keypoint) in keypoints.iter().enumerate() {
                let inside = (keypoint.pixel - pixel).amax() <= radius;
                assert!(!inside || near.contains(&index));
            }
        }
    }
}
