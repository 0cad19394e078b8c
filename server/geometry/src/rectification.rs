//! Stereo rectification after Bouguet, with the conventions of OpenCV's `stereoRectify` at `alpha = 0` with
//! `CALIB_ZERO_DISPARITY`: each camera turns by half of their relative rotation, then both turn so that the
//! baseline is the x axis; one focal length and one principal point for both; every rectified pixel is seen by
//! its camera. OpenCV probes each edge of the view at nine places and stops undistorting after five steps; here
//! every edge pixel is probed and the undistortion converges, so that every
//! rectified pixel is truly seen; figures differ by about a tenth of a pixel.

use nalgebra::{Isometry3, Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};

use crate::remap::{Blend, RemapTable};
use crate::validate::check_side_by_side;
use crate::{
    CameraModel, GeometryError, Gray, Mask, Pinhole, Pose, Raster, Rgb, StereoCalibration, StereoRig,
};

/// One of the two cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eye {
    /// The reference camera.
    Left,
    /// The camera at `+baseline_m`.
    Right,
}

impl Eye {
    fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// The rectified rig of a calibration, and the tables that make its images.
#[derive(Clone, Debug)]
pub struct Rectification {
    rig: StereoRig,
    left: EyeMap,
    right: EyeMap,
}

#[derive(Clone, Debug)]
struct EyeMap {
    turned: TurnedCamera,
    table: RemapTable,
}

/// A camera and the rotation that rectifies it.
#[derive(Clone, Copy, Debug)]
struct TurnedCamera {
    camera: CameraModel,
    rectified_from_raw: Rotation3<f64>,
}

impl Rectification {
    /// Computes the rectified rig and the remap tables of both eyes.
    ///
    /// # Errors
    /// What [`crate::validate::check_calibration`] refuses but for the baseline's length;
    /// [`GeometryError::NotUndistortable`] where the lens model does not cover the image;
    /// [`GeometryError::NoCommonView`] where no upright rectangle is seen by both.
    pub fn from_calibration(calibration: &StereoCalibration) -> Result<Self, GeometryError> {
        let baseline_m = check_side_by_side(calibration)?.norm();
        let (left, right) = turn_level(calibration);
        let pinhole = common_pinhole(&left, &right)?;
        let rig = StereoRig { left: pinhole, baseline_m, right_cx_px: pinhole.cx_px };
        let map = |turned: TurnedCamera| EyeMap {
            turned,
            table: RemapTable::new((pinhole.width_px, pinhole.height_px), |rectified| {
                turned.raw_pixel(&pinhole, rectified)
            }),
        };
        Ok(Self { rig, left: map(left), right: map(right) })
    }

    /// The rig of the rectified images.
    pub fn rig(&self) -> &StereoRig {
        &self.rig
    }

    /// The rotation from an eye's calibrated camera frame to its rectified one; the centres coincide.
    pub fn rectified_from_raw(&self, eye: Eye) -> Pose {
        let rotation = self.eye(eye).turned.rectified_from_raw;
        Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_rotation_matrix(&rotation))
    }

    /// Rectifies a pair of luminance images; what the cameras do not see is black.
    ///
    /// # Errors
    /// [`GeometryError::ImageSize`] where an image is not of the calibrated size.
    pub fn rectify_gray(&self, left: &Gray, right: &Gray) -> Result<(Gray, Gray), GeometryError> {
        Ok((self.rectify(Eye::Left, left)?, self.rectify(Eye::Right, right)?))
    }

    /// Rectifies a pair of colour images; what the cameras do not see is black.
    ///
    /// # Errors
    /// [`GeometryError::ImageSize`] where an image is not of the calibrated size.
    pub fn rectify_rgb(&self, left: &Rgb, right: &Rgb) -> Result<(Rgb, Rgb), GeometryError> {
        Ok((self.rectify(Eye::Left, left)?, self.rectify(Eye::Right, right)?))
    }

    /// Rectifies an eye's mask without mixing labels; what the camera does not see is covered.
    ///
    /// # Errors
    /// [`GeometryError::ImageSize`] where the mask is not of the calibrated size.
    pub fn rectify_mask(&self, eye: Eye, mask: &Mask) -> Result<Mask, GeometryError> {
        self.check_size(eye, mask)?;
        Ok(self.eye(eye).table.nearest(mask))
    }

    /// Covers the rectified pixels that an eye does not see.
    pub fn blind_mask(&self, eye: Eye) -> Mask {
        self.eye(eye).table.blind()
    }

    /// The pixel of an eye's own image that a rectified pixel shows; `None` behind the camera.
    pub fn raw_pixel(&self, eye: Eye, rectified: &Point2<f64>) -> Option<Point2<f64>> {
        self.eye(eye).turned.raw_pixel(&self.rig.left, rectified)
    }

    /// The rectified pixel that shows a pixel of an eye's own image.
    ///
    /// # Errors
    /// [`GeometryError::NotUndistortable`] where no ray is seen there.
    pub fn rectified_pixel(&self, eye: Eye, raw: &Point2<f64>) -> Result<Point2<f64>, GeometryError> {
        Ok(self.rig.left.project(&self.eye(eye).turned.rectified_ray(raw)?))
    }

    fn rectify<T: Blend>(&self, eye: Eye, image: &Raster<T>) -> Result<Raster<T>, GeometryError> {
        self.check_size(eye, image)?;
        Ok(self.eye(eye).table.bilinear(image))
    }

    fn check_size<T>(&self, eye: Eye, image: &Raster<T>) -> Result<(), GeometryError> {
        let expected = (self.rig.left.width_px, self.rig.left.height_px);
        if image.size() == expected {
            return Ok(());
        }
        Err(GeometryError::ImageSize { eye: eye.name(), expected, got: image.size() })
    }

    fn eye(&self, eye: Eye) -> &EyeMap {
        match eye {
            Eye::Left => &self.left,
            Eye::Right => &self.right,
        }
    }
}

impl TurnedCamera {
    fn rectified_ray(&self, raw: &Point2<f64>) -> Result<Point3<f64>, GeometryError> {
        Ok(self.rectified_from_raw * self.camera.ray(raw)?)
    }

    fn raw_pixel(&self, pinhole: &Pinhole, rectified: &Point2<f64>) -> Option<Point2<f64>> {
        let ray = self.rectified_from_raw.inverse_transform_point(&pinhole.back_project(rectified, 1.0));
        (ray.z > 0.0).then(|| self.camera.project(&ray))
    }

    /// A pixel of the raw image on the rectified image plane at `z = 1`.
    fn on_plane(&self, x_px: f64, y_px: f64) -> Result<Vector2<f64>, GeometryError> {
        let ray = self.rectified_ray(&Point2::new(x_px, y_px))?;
        if ray.z > 0.0 {
            return Ok(ray.xy().coords / ray.z);
        }
        Err(GeometryError::NoCommonView(format!("raw pixel ({x_px}, {y_px}) looks backwards")))
    }
}

/// Turns both cameras by half of their rotation, then the baseline onto the x axis.
fn turn_level(calibration: &StereoCalibration) -> (TurnedCamera, TurnedCamera) {
    let motion = &calibration.right_from_left;
    let half_back = Rotation3::from_scaled_axis(motion.rotation.scaled_axis() * -0.5);
    let translation = half_back * motion.translation.vector;
    let to_axis = translation.cross(&-Vector3::x());
    let angle = to_axis.norm().atan2(-translation.x);
    let level = match to_axis.try_normalize(0.0) {
        Some(axis) => Rotation3::from_scaled_axis(axis * angle),
        None => Rotation3::identity(),
    };
    let turned = |camera, rectified_from_raw| TurnedCamera { camera, rectified_from_raw };
    (turned(calibration.left, level * half_back.inverse()), turned(calibration.right, level * half_back))
}

/// The pinhole of both rectified images: the smallest zoom at which every pixel is seen by both cameras.
fn common_pinhole(left: &TurnedCamera, right: &TurnedCamera) -> Result<Pinhole, GeometryError> {
    let raw = left.camera.pinhole;
    let last = Vector2::new(f64::from(raw.width_px - 1), f64::from(raw.height_px - 1));
    let focal_px = 0.5 * (raw.fy_px + right.camera.pinhole.fy_px);
    let corners = (corner_mean(left, last)? + corner_mean(right, last)?) * 0.5;
    let centre = last * 0.5 - corners * focal_px;
    let zoom = zoom_to_fill(left, centre, last, focal_px)?.max(zoom_to_fill(right, centre, last, focal_px)?);
    let focal_px = focal_px * zoom;
    Ok(Pinhole { fx_px: focal_px, fy_px: focal_px, cx_px: centre.x, cy_px: centre.y, ..raw })
}

fn corner_mean(turned: &TurnedCamera, last: Vector2<f64>) -> Result<Vector2<f64>, GeometryError> {
    let corners = [(0.0, 0.0), (last.x, 0.0), (0.0, last.y), (last.x, last.y)];
    let mut sum = Vector2::zeros();
    for (x, y) in corners {
        sum += turned.on_plane(x, y)?;
    }
    Ok(sum / 4.0)
}

/// The zoom at which the largest upright rectangle inside one camera's view fills the image.
fn zoom_to_fill(
    turned: &TurnedCamera,
    centre: Vector2<f64>,
    last: Vector2<f64>,
    focal_px: f64,
) -> Result<f64, GeometryError> {
    let mut low = Vector2::repeat(f64::NEG_INFINITY);
    let mut high = Vector2::repeat(f64::INFINITY);
    for y in 0..turned.camera.pinhole.height_px {
        low.x = low.x.max(turned.on_plane(0.0, f64::from(y))?.x * focal_px);
        high.x = high.x.min(turned.on_plane(last.x, f64::from(y))?.x * focal_px);
    }
    for x in 0..turned.camera.pinhole.width_px {
        low.y = low.y.max(turned.on_plane(f64::from(x), 0.0)?.y * focal_px);
        high.y = high.y.min(turned.on_plane(f64::from(x), last.y)?.y * focal_px);
    }
    if low.max() >= 0.0 || high.min() <= 0.0 {
        return Err(GeometryError::NoCommonView(format!(
            "the axis is outside x {} to {}, y {} to {} px",
            low.x, high.x, low.y, high.y
        )));
    }
    let below = centre.component_div(&-low);
    let above = (last - centre).component_div(&high);
    Ok(below.max().max(above.max()))
}
