//! Rendered stereo sequences and the configuration that the server ships.
#![allow(dead_code)] // each test binary uses its part

use geometry::{Gray, Pinhole, Pose, Raster, StereoRig, se3};
use nalgebra::{Point3, Vector3, Vector6};
use tracking::TrackingConfig;

/// The section `[tracking]` of the server's configuration.
pub fn config() -> TrackingConfig {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/server.toml");
    let mut file: toml::Table =
        std::fs::read_to_string(path).expect("server.toml").parse().expect("server.toml is TOML");
    file.remove("tracking").expect("a section [tracking]").try_into().expect("a tracking configuration")
}

/// A small endoscope: 320x240, 5 mm baseline.
pub fn rig() -> StereoRig {
    let left =
        Pinhole { width_px: 320, height_px: 240, fx_px: 260.0, fy_px: 260.0, cx_px: 159.5, cy_px: 119.5 };
    StereoRig { left, baseline_m: 0.005, right_cx_px: 159.5 }
}

/// A textured relief 80 mm away, with hills of 6 mm.
pub struct Relief;

impl Relief {
    fn height_m(x_m: f64, y_m: f64) -> f64 {
        0.080 + 0.003 * (x_m * 90.0).sin() + 0.003 * (y_m * 110.0 + x_m * 40.0).cos()
    }

    /// Value noise of several octaves, finest about 1 mm.
    fn brightness(x_m: f64, y_m: f64) -> f64 {
        let octave = |size_m: f64, gain: f64| gain * value_noise(x_m / size_m, y_m / size_m);
        octave(0.012, 50.0) + octave(0.004, 60.0) + octave(0.0013, 50.0) + 45.0
    }

    /// Where a ray meets the relief, by fixed-point iteration; slopes stay well below one.
    fn hit(origin: &Point3<f64>, direction: &Vector3<f64>) -> Point3<f64> {
        let mut point = origin + direction * ((0.080 - origin.z) / direction.z);
        for _ in 0..12 {
            point = origin + direction * ((Self::height_m(point.x, point.y) - origin.z) / direction.z);
        }
        point
    }

    fn render_camera(camera: &Pinhole, cx_px: f64, world_from_camera: &Pose) -> Gray {
        let origin = Point3::from(world_from_camera.translation.vector);
        Raster::from_fn(camera.width_px, camera.height_px, |x, y| {
            let ray = Vector3::new(
                (f64::from(x) - cx_px) / camera.fx_px,
                (f64::from(y) - camera.cy_px) / camera.fy_px,
                1.0,
            );
            let point = Self::hit(&origin, &(world_from_camera.rotation * ray));
            Self::brightness(point.x, point.y).clamp(20.0, 240.0) as u8
        })
    }

    /// Left and right image from a pose.
    pub fn render(rig: &StereoRig, world_from_camera: &Pose) -> (Gray, Gray) {
        let right_pose = world_from_camera * nalgebra::Translation3::new(rig.baseline_m, 0.0, 0.0);
        let left = Self::render_camera(&rig.left, rig.left.cx_px, world_from_camera);
        (left, Self::render_camera(&rig.left, rig.right_cx_px, &right_pose))
    }
}

/// Smooth noise in 0 to 1 with one feature per unit.
fn value_noise(x: f64, y: f64) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (ease(x - x0), ease(y - y0));
    let corner = |dx: i64, dy: i64| hash(x0 as i64 + dx, y0 as i64 + dy);
    let top = corner(0, 0) * (1.0 - tx) + corner(1, 0) * tx;
    let bottom = corner(0, 1) * (1.0 - tx) + corner(1, 1) * tx;
    top * (1.0 - ty) + bottom * ty
}

/// A hash (`SplitMix64`) of a lattice point, 0 to 1.
fn hash(x: i64, y: i64) -> f64 {
    let mut z =
        (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// A scope that circles sideways and looks around a little; frame 0 is the identity.
pub fn scope_motion(frame: usize) -> Pose {
    let t = frame as f64 * 0.06;
    let tangent = Vector6::new(
        0.012 * t.sin(),
        0.008 * (1.0 - t.cos()),
        0.006 * (2.0 * t).sin(),
        0.05 * (1.5 * t).sin(),
        -0.06 * t.sin(),
        0.10 * (0.7 * t).sin(),
    );
    se3::exp(&tangent)
}

/// Stamps at 30 frames per second.
pub fn stamp_ns(frame: usize) -> u64 {
    1_000_000_000 + frame as u64 * 33_333_333
}
