//! CPU mirror of `measure_surface.wgsl`: depth by the rig, the normal from three back-projected points of the plane.

use geometry::{Pinhole, StereoRig};
use gpu::{FrameRecorder, StageTimer};
use nalgebra::{Point2, Point3};

use super::measure_surface::{self, Triangulation};
use super::{Preprocess, SurfaceStage};
use crate::disparity::testing::{SIZES, config, hostile};
use crate::disparity::{DisparityRange, DisparityStage};
use crate::testing::{Numbers, gpu};
use crate::{DenseError, Observation};

const DRIFT_PX: f64 = 0.75;
const INCIDENCE_MAX_DEG: f64 = 70.0;

fn rig((width_px, height_px): (u32, u32)) -> StereoRig {
    let left = Pinhole { width_px, height_px, fx_px: 520.0, fy_px: 505.0, cx_px: 20.3, cy_px: 14.1 };
    StereoRig { left, baseline_m: 0.005, right_cx_px: 24.3 }
}

/// Random planes, among them unknown ones and such at or beyond infinity.
fn planes(pixels: usize) -> Vec<[f32; 4]> {
    let mut numbers = Numbers::new(50);
    let mut plane = |index: usize| match index % 9 {
        0 => [-1.0e6, 0.0, 0.0, 0.0],
        1 => [-4.0, 0.1, 0.0, 0.1],
        2 => [f32::NAN, f32::INFINITY, 0.0, f32::NAN],
        _ => {
            let [a, b, c, d] = [0; 4].map(|_| numbers.next() as f32);
            [30.0 + 15.0 * a, 0.2 * b, 0.2 * c, 0.2 + 0.1 * d]
        }
    };
    (0..pixels).map(&mut plane).collect()
}

fn check(size: (u32, u32)) {
    let gpu = gpu();
    let (rig, image) = (rig(size), hostile(size, 51));
    let input = Preprocess::new(&gpu, size, &config()).unwrap();
    input.upload(&gpu, &image, &image, None).unwrap();
    let observation = Observation::new(&gpu, size.0, size.1).unwrap();
    let planes = planes((size.0 * size.1) as usize);
    let buffer = gpu.storage_from("planes", &planes).unwrap();
    // Drift is the same as another principal point of the right camera.
    let calibrated = StereoRig { right_cx_px: rig.right_cx_px + DRIFT_PX, ..rig };
    let triangulation =
        gpu.uniform("triangulation", &Triangulation::new(&calibrated, DRIFT_PX, INCIDENCE_MAX_DEG)).unwrap();
    let kernel = measure_surface::bind(&gpu, &triangulation, &buffer, input.left(), &observation).unwrap();
    let timer = StageTimer::new(&gpu, 2).unwrap();
    let mut frame = FrameRecorder::begin(&gpu, &timer);
    input.record(&mut frame).unwrap();
    frame.stage("surface", |stage| stage.run(&kernel, [size.0, size.1, 1])).unwrap();
    frame.submit().collect().unwrap();
    let depth = gpu.read(&observation.depth).unwrap();
    let sigma = gpu.read(&observation.sigma_z).unwrap();
    let normal = gpu.read(&observation.normal).unwrap();
    let color = gpu.read(&observation.color).unwrap();
    let grey = image.to_gray();
    let mut refused = 0;
    for (index, plane) in planes.iter().enumerate() {
        let (x, y) = (index as u32 % size.0, index as u32 / size.0);
        let seen = (13..250).contains(&grey[(x, y)]);
        assert_eq!(color[index] >> 24, if seen { 255 } else { 0 });
        assert_eq!((color[index] & 255) as u8, image[(x, y)][0]);
        let nothing = (depth[index], sigma[index], normal[index]) == (0.0, 0.0, [0.0; 4]);
        if !seen || index % 9 < 3 {
            assert!(nothing, "({x}, {y})");
            continue;
        }
        let point = |dx: f64, dy: f64| -> Point3<f64> {
            let disparity = f64::from(plane[0]) + f64::from(plane[1]) * dx + f64::from(plane[2]) * dy;
            let pixel = Point2::new(f64::from(x) + dx, f64::from(y) + dy);
            rig.left.back_project(&pixel, rig.depth_m(disparity))
        };
        let (here, right, below) = (point(0.0, 0.0), point(1e-3, 0.0), point(0.0, 1e-3));
        let expected = (below - here).cross(&(right - here)).normalize();
        let incidence_deg = (-expected.dot(&here.coords.normalize())).acos().to_degrees();
        if (incidence_deg - INCIDENCE_MAX_DEG).abs() > 0.01 {
            assert_eq!(nothing, incidence_deg > INCIDENCE_MAX_DEG, "({x}, {y}): {incidence_deg}");
        }
        if nothing {
            refused += 1;
            continue;
        }
        let error = (0..3).map(|k| (f64::from(normal[index][k]) - expected[k]).abs()).fold(0.0, f64::max);
        assert!(error < 1e-4, "({x}, {y}): {:?}, expected {expected}", normal[index]);
        assert!(expected.dot(&here.coords) < 0.0, "normals face the camera");
        assert!((f64::from(depth[index]) - here.z).abs() < 1e-6 * here.z.max(1.0));
        let slope = here.z * here.z / (520.0 * 0.005);
        assert!((f64::from(sigma[index]) - slope * f64::from(plane[3])).abs() < 1e-5 * slope);
    }
    assert!(size.0 * size.1 < 100 || refused > 0, "some planes are seen too flat");
}

#[test]
fn depth_and_normals_equal_those_of_back_projected_points() {
    SIZES.into_iter().for_each(check);
}

#[test]
fn a_rig_of_another_size_is_refused() {
    let gpu = gpu();
    let input = Preprocess::new(&gpu, (64, 48), &config()).unwrap();
    let range = DisparityRange::new(0, 14).unwrap();
    let disparity = DisparityStage::new(&gpu, &input, range, &config()).unwrap();
    let observation = Observation::new(&gpu, 64, 48).unwrap();
    let refused = SurfaceStage::new(&gpu, &rig((64, 47)), &input, &disparity, &observation, &config());
    assert!(matches!(refused.unwrap_err(), DenseError::ImageSize { what: "prepared", .. }));
}
