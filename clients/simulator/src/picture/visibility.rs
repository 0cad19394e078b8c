//! Which face each pixel sees, exact at the pixel's centre.

use geometry::{Pinhole, Pose, Raster};
use nalgebra::Point3;
use rayon::prelude::*;

/// Nothing nearer than this is drawn.
const NEAR_M: f64 = 2e-3;
/// Rows that one task fills.
const BAND_ROWS: usize = 16;
/// Pixel centres this far outside an edge (share of the face) still count, so that shared edges have no gaps.
const EDGE_SLACK: f64 = 1e-10;
const NO_FACE: u32 = u32::MAX;
/// Thumbnails answer which tissue is in view; a sixteenth of the pixels is enough.
const THUMBNAIL: u32 = 4;

/// A vertex on the picture.
#[derive(Clone, Copy)]
struct Projected {
    u: f64,
    v: f64,
    /// 1 / depth in metres, 0 if too near or behind.
    inverse_depth: f64,
}

/// The nearest face at each pixel centre.
pub(crate) struct VisibilityBuffer {
    projected: Vec<Projected>,
    faces: Raster<u32>,
    /// 1 / depth, single precision: for comparing only.
    nearest: Raster<f32>,
}

/// Where in a face a pixel's ray hits.
#[derive(Clone, Copy)]
pub(crate) struct Hit {
    pub face: u32,
    pub barycentric: [f64; 3],
    pub depth_m: f64,
}

/// A face with the edge functions that tell inside from outside.
struct ScreenFace {
    index: u32,
    corners: [Projected; 3],
    twice_area: f64,
    rows: [usize; 2],
    columns: [usize; 2],
}

/// The same view at a quarter of the size.
pub(crate) fn thumbnail_camera(camera: &Pinhole) -> Pinhole {
    let scale = f64::from(THUMBNAIL);
    let centre = |c: f64| (c + 0.5) / scale - 0.5;
    Pinhole {
        width_px: camera.width_px / THUMBNAIL,
        height_px: camera.height_px / THUMBNAIL,
        fx_px: camera.fx_px / scale,
        fy_px: camera.fy_px / scale,
        cx_px: centre(camera.cx_px),
        cy_px: centre(camera.cy_px),
    }
}

impl VisibilityBuffer {
    /// Draws the faces that turn their outward side to the camera.
    pub fn new(
        positions: &[Point3<f64>],
        faces: &[[u32; 3]],
        camera_from_world: &Pose,
        camera: &Pinhole,
    ) -> Self {
        // a matrix turns a quarter of a million points faster than a quaternion
        let rotation = camera_from_world.rotation.to_rotation_matrix();
        let translation = camera_from_world.translation;
        let project = |point: &Point3<f64>| {
            let in_camera = translation * (rotation * point);
            let pixel = camera.project(&in_camera);
            let inverse_depth = if in_camera.z > NEAR_M { 1.0 / in_camera.z } else { 0.0 };
            Projected { u: pixel.x, v: pixel.y, inverse_depth }
        };
        let projected: Vec<Projected> = positions.par_iter().map(project).collect();
        let on_screen: Vec<ScreenFace> = faces
            .par_iter()
            .enumerate()
            .filter_map(|(index, face)| {
                ScreenFace::new(index as u32, face.map(|i| projected[i as usize]), camera)
            })
            .collect();
        let (width, height) = (camera.width_px, camera.height_px);
        let mut buffer = Self {
            projected,
            faces: Raster::filled(width, height, NO_FACE),
            nearest: Raster::filled(width, height, 0.0),
        };
        let band = BAND_ROWS * width as usize;
        let face_bands = buffer.faces.pixels_mut().par_chunks_mut(band);
        let depth_bands = buffer.nearest.pixels_mut().par_chunks_mut(band);
        face_bands.zip(depth_bands).enumerate().for_each(|(number, (face_band, depth_band))| {
            let first_row = number * BAND_ROWS;
            for face in &on_screen {
                face.draw(first_row, width as usize, face_band, depth_band);
            }
        });
        buffer
    }

    /// The face at a pixel.
    pub fn face_at(&self, x: u32, y: u32) -> Option<u32> {
        Some(self.faces[(x, y)]).filter(|&face| face != NO_FACE)
    }

    /// Where the ray of a pixel's centre meets the face that it sees.
    pub fn hit(&self, faces: &[[u32; 3]], x: u32, y: u32) -> Option<Hit> {
        let face = self.face_at(x, y)?;
        let corners = faces[face as usize].map(|i| self.projected[i as usize]);
        let edges = edge_functions(&corners, f64::from(x), f64::from(y));
        // perspective: shares of the face are those on the screen weighted by 1 / depth
        let weighted = [0, 1, 2].map(|i| edges[i] * corners[i].inverse_depth);
        let sum: f64 = weighted.iter().sum();
        let depth_m = edges.iter().sum::<f64>() / sum;
        Some(Hit { face, barycentric: weighted.map(|w| w / sum), depth_m })
    }

    /// Whether a vertex is in the picture and nothing lies before it by more than `tolerance_m`.
    pub fn shows(&self, vertex: usize, tolerance_m: f64) -> bool {
        let Projected { u, v, inverse_depth } = self.projected[vertex];
        let (x, y) = ((u + 0.5).floor() as i64, (v + 0.5).floor() as i64);
        match self.nearest.get(x, y) {
            Some(&nearest) if inverse_depth > 0.0 && nearest > 0.0 => {
                1.0 / inverse_depth < 1.0 / f64::from(nearest) + tolerance_m
            }
            _ => false,
        }
    }
}

/// Twice the signed areas of the triangles that a pixel makes with the edges opposite to each corner.
fn edge_functions(corners: &[Projected; 3], x: f64, y: f64) -> [f64; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(from, to)| {
        let (a, b) = (corners[from], corners[to]);
        (b.u - a.u) * (y - a.v) - (b.v - a.v) * (x - a.u)
    })
}

impl ScreenFace {
    /// `None` for faces off the picture, behind the camera, or seen from inside.
    fn new(index: u32, corners: [Projected; 3], camera: &Pinhole) -> Option<Self> {
        if corners.iter().any(|corner| corner.inverse_depth == 0.0) {
            return None;
        }
        let [a, b, c] = corners;
        let twice_area = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
        if twice_area >= -1e-12 {
            return None; // y runs down, so outward counter-clockwise is negative
        }
        let columns = pixel_range(corners.map(|corner| corner.u), camera.width_px)?;
        let rows = pixel_range(corners.map(|corner| corner.v), camera.height_px)?;
        Some(Self { index, corners, twice_area, rows, columns })
    }

    fn draw(&self, first_row: usize, width: usize, faces: &mut [u32], nearest: &mut [f32]) {
        let last_row = first_row + nearest.len() / width - 1;
        for y in self.rows[0].max(first_row)..=self.rows[1].min(last_row) {
            let row = (y - first_row) * width;
            for x in self.columns[0]..=self.columns[1] {
                let edges = edge_functions(&self.corners, x as f64, y as f64);
                let shares = edges.map(|edge| edge / self.twice_area);
                if shares.iter().any(|&share| share < -EDGE_SLACK) {
                    continue;
                }
                let inverse_depth: f64 = shares
                    .iter()
                    .zip(&self.corners)
                    .map(|(share, corner)| share * corner.inverse_depth)
                    .sum();
                if inverse_depth as f32 > nearest[row + x] {
                    nearest[row + x] = inverse_depth as f32;
                    faces[row + x] = self.index;
                }
            }
        }
    }
}

/// First and last pixel whose centre lies within the corners, if any is in the picture.
fn pixel_range(corners: [f64; 3], size: u32) -> Option<[usize; 2]> {
    let (low, high) =
        (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
    let last = f64::from(size) - 1.0;
    if high < 0.0 || low > last {
        return None; // most faces: rounding, a library call, is not for them
    }
    let (low, high) = (low.max(0.0).ceil(), high.min(last).floor());
    (low <= high).then_some([low as usize, high as usize])
}
