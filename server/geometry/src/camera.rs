//! Cameras as they are built, before rectification.

use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

use crate::{Distortion, GeometryError, Pinhole, Pose};

/// A pinhole behind a distorting lens.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraModel {
    /// Size, focal lengths and principal point.
    pub pinhole: Pinhole,
    /// The lens.
    pub distortion: Distortion,
}

impl CameraModel {
    /// The pixel at which a point of the camera frame appears; meaningless for `z <= 0`.
    pub fn project(&self, point_in_camera: &Point3<f64>) -> Point2<f64> {
        let ideal = point_in_camera.xy() / point_in_camera.z;
        let shown = self.distortion.distort(&ideal);
        self.pinhole.project(&Point3::new(shown.x, shown.y, 1.0))
    }

    /// The point at `z = 1` m on the ray that a pixel sees.
    ///
    /// # Errors
    /// [`GeometryError::NotUndistortable`] where no ray is seen there.
    pub fn ray(&self, pixel: &Point2<f64>) -> Result<Point3<f64>, GeometryError> {
        let ideal = self.distortion.undistort(&self.pinhole.back_project(pixel, 1.0).xy())?;
        Ok(Point3::new(ideal.x, ideal.y, 1.0))
    }
}

/// Two cameras as calibrated, images not rectified.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StereoCalibration {
    /// The left camera.
    pub left: CameraModel,
    /// The right camera.
    pub right: CameraModel,
    /// Takes points of the left camera frame to the right one; its `translation.x` is negative.
    pub right_from_left: Pose,
}
