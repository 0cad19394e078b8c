//! One picture for each eye, side by side, for 3-D monitors.

use geometry::{Pinhole, Pose};
use render::{Eye, Viewport};

use crate::Camera;

/// Share of the distance to what is looked at by which the eyes are apart: comfortable on most monitors.
const SEPARATION_SHARE: f64 = 1.0 / 30.0;

/// How a frame is divided between the eyes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stereo {
    /// One picture for both.
    #[default]
    Off,
    /// Two pictures, each squeezed to half its width: what 3-D monitors take as one frame of their own size.
    HalfWidth,
    /// Two pictures of the right proportions, each half as wide as the frame.
    FullWidth,
}

impl Stereo {
    /// Size of the picture that one eye sees, before it is squeezed.
    pub fn eye_size_px(self, (width, height): (u32, u32)) -> (u32, u32) {
        match self {
            Self::Off | Self::HalfWidth => (width, height),
            Self::FullWidth => ((width / 2).max(1), height),
        }
    }

    /// The next of the three.
    pub fn next(self) -> Self {
        match self {
            Self::Off => Self::HalfWidth,
            Self::HalfWidth => Self::FullWidth,
            Self::FullWidth => Self::Off,
        }
    }

    /// The eyes of a camera whose image has [`Self::eye_size_px`]; `separation_m` apart, or as far as is comfortable.
    pub fn eyes(self, camera: &Camera, (width, height): (u32, u32), separation_m: Option<f64>) -> Vec<Eye> {
        let viewport = |x, width| Viewport { x, y: 0, width, height };
        if self == Self::Off {
            return vec![eye(camera, 0.0, viewport(0, width))];
        }
        let half = (width / 2).max(1);
        let apart_m = separation_m.unwrap_or(camera.convergence_m * SEPARATION_SHARE);
        let right_edge = width.saturating_sub(half);
        vec![
            eye(camera, -apart_m / 2.0, viewport(0, half)),
            eye(camera, apart_m / 2.0, viewport(right_edge, half)),
        ]
    }
}

/// Both eyes look straight ahead; their images are shifted so that what is at the distance of convergence lies at one
/// place in both, on the plane of the screen.
fn eye(camera: &Camera, to_the_right_m: f64, viewport: Viewport) -> Eye {
    let shift_px = camera.pinhole.fx_px * to_the_right_m / camera.convergence_m;
    Eye {
        pinhole: Pinhole { cx_px: camera.pinhole.cx_px + shift_px, ..camera.pinhole },
        world_from_camera: camera.world_from_camera * Pose::translation(to_the_right_m, 0.0, 0.0),
        viewport,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn camera(size_px: (u32, u32)) -> Camera {
        Camera {
            pinhole: Pinhole::of_opening(size_px, 0.4),
            world_from_camera: Pose::translation(0.01, 0.02, 0.03),
            convergence_m: 0.1,
        }
    }

    fn seen(eye: &Eye, in_camera: Point3<f64>) -> f64 {
        let in_world = Pose::translation(0.01, 0.02, 0.03) * in_camera;
        eye.pinhole.project(&(eye.world_from_camera.inverse() * in_world)).x
    }

    #[test]
    fn what_is_at_the_convergence_distance_lies_on_the_screen_and_nearer_things_before_it() {
        let stereo = Stereo::HalfWidth;
        let eyes = stereo.eyes(&camera(stereo.eye_size_px((640, 480))), (640, 480), Some(4e-3));
        let disparity =
            |z| seen(&eyes[0], Point3::new(0.01, 0.0, z)) - seen(&eyes[1], Point3::new(0.01, 0.0, z));
        assert!(disparity(0.1).abs() < 1e-9);
        // Crossed: the left eye sees what is near further to the right.
        assert!(disparity(0.08) > 1.0);
        assert!(disparity(0.2) < -1.0);
    }

    #[test]
    fn the_halves_fill_the_frame() {
        for (stereo, width) in [(Stereo::HalfWidth, 640), (Stereo::FullWidth, 320)] {
            assert_eq!(stereo.eye_size_px((640, 480)), (width, 480));
            let eyes = stereo.eyes(&camera(stereo.eye_size_px((640, 480))), (640, 480), None);
            let places: Vec<_> = eyes.iter().map(|eye| (eye.viewport.x, eye.viewport.width)).collect();
            assert_eq!(places, [(0, 320), (320, 320)]);
        }
        assert_eq!(Stereo::Off.eyes(&camera((640, 480)), (640, 480), None).len(), 1);
    }
}
