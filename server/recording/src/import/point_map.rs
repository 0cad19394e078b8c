//! Maps of points in the left camera's frame, and the depth that the rectified view sees of them.

use std::io::Cursor;
use std::path::Path;

use geometry::{DepthMap, Eye, Pinhole, Pose, Raster, Rectification};
use image::codecs::tiff::TiffDecoder;
use image::{ColorType, DynamicImage, ImageDecoder};
use nalgebra::Point3;

use crate::{Calibration, RecordingError};

/// The points that the pixels of the left camera show, metres; not finite where unknown.
pub(super) type PointMap = Raster<[f32; 3]>;

/// Reads a TIFF of three 32-bit floats a pixel, of the image's size or with the right camera's map below.
///
/// # Errors
/// [`RecordingError::Input`] names the file and its size or kind.
pub(super) fn read(
    path: &Path,
    (width, height): (u32, u32),
    unit_m: f64,
) -> Result<PointMap, RecordingError> {
    let refused = |problem: String| RecordingError::input(path, problem);
    let bytes = std::fs::read(path).map_err(RecordingError::io(path))?;
    let decoder = TiffDecoder::new(Cursor::new(bytes)).map_err(|error| refused(error.to_string()))?;
    let (own_width, own_height) = decoder.dimensions();
    if own_width != width || (own_height != height && own_height != 2 * height) {
        return Err(refused(format!("{own_width}x{own_height} points for images of {width}x{height}")));
    }
    if decoder.color_type() != ColorType::Rgb32F {
        return Err(refused(format!("{:?} where three 32-bit floats are needed", decoder.color_type())));
    }
    let points =
        DynamicImage::from_decoder(decoder).map_err(|error| refused(error.to_string()))?.into_rgb32f();
    let scaled = |value: f32| (f64::from(value) * unit_m) as f32;
    Ok(Raster::from_fn(width, height, |x, y| points.get_pixel(x, y).0.map(scaled)))
}

/// The rectified left view, into which points of the left camera are projected.
pub(super) struct RectifiedView {
    rectified_from_left: Pose,
    pinhole: Pinhole,
}

impl RectifiedView {
    /// That of a calibration.
    ///
    /// # Errors
    /// [`RecordingError::Calibration`] where it cannot be rectified.
    pub fn of(calibration: &Calibration) -> Result<Self, RecordingError> {
        Ok(match calibration {
            Calibration::Rectified(rig) => Self { rectified_from_left: Pose::identity(), pinhole: rig.left },
            Calibration::Raw(raw) => {
                let rectification = Rectification::from_calibration(raw)?;
                let rectified_from_left = rectification.rectified_from_raw(Eye::Left);
                Self { rectified_from_left, pinhole: rectification.rig().left }
            }
        })
    }

    /// Depth of the nearest point in each pixel; 0 where none falls.
    pub fn depth_of(&self, points: &PointMap) -> DepthMap {
        let (width, height) = (self.pinhole.width_px, self.pinhole.height_px);
        let mut depth = DepthMap::filled(width, height, 0.0);
        for point in points.pixels() {
            let in_left = Point3::from(point.map(f64::from));
            // Written so that a NaN is left out too.
            let is_known = in_left.z > 0.0 && in_left.coords.iter().all(|value| value.is_finite());
            if !is_known {
                continue;
            }
            let rectified = self.rectified_from_left * in_left;
            let pixel = self.pinhole.project(&rectified);
            let (x, y) = (pixel.x.round(), pixel.y.round());
            if rectified.z > 0.0
                && (0.0..f64::from(width)).contains(&x)
                && (0.0..f64::from(height)).contains(&y)
            {
                let nearest = &mut depth.pixels_mut()[y as usize * width as usize + x as usize];
                if *nearest == 0.0 || rectified.z < f64::from(*nearest) {
                    *nearest = rectified.z as f32;
                }
            }
        }
        depth
    }
}

#[cfg(test)]
mod tests {
    use geometry::StereoRig;

    use super::*;

    #[test]
    fn the_nearest_point_of_a_pixel_is_its_depth_and_the_unknown_stays_unknown() {
        let left = Pinhole { width_px: 8, height_px: 6, fx_px: 10.0, fy_px: 10.0, cx_px: 4.0, cy_px: 3.0 };
        let rig = StereoRig { left, baseline_m: 0.005, right_cx_px: 4.0 };
        let view = RectifiedView::of(&Calibration::Rectified(rig)).unwrap();
        let points = vec![[0.0, 0.0, 0.2], [0.0, 0.0, 0.1], [f32::NAN, 0.0, 0.1], [9.0, 0.0, 0.1], [0.0; 3]];
        let depth = view.depth_of(&Raster::from_vec(5, 1, points).unwrap());
        assert_eq!(depth[(4, 3)], 0.1);
        assert_eq!(depth.pixels().iter().filter(|&&depth_m| depth_m > 0.0).count(), 1);
    }
}
