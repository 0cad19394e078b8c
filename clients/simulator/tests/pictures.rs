//! Pictures agree with each other and with their depth.

mod common;

use common::small;
use geometry::{DepthMap, Rgb};
use simulator::{SceneConfig, SceneKind, SimulatedFrame, Simulation};

/// Only what both eyes see alike: no noise, highlights, vignette or blur.
fn lambertian(scene: SceneKind) -> SceneConfig {
    let plain =
        SceneConfig { noise: false, highlights: false, vignette: 0.0, exposure_ms: 0.0, ..small(scene) };
    SceneConfig { width_px: 320, height_px: 240, ..plain }
}

fn green(picture: &Rgb, x: u32, y: u32) -> f64 {
    f64::from(picture[(x, y)][1])
}

fn green_between(picture: &Rgb, x: f64, y: u32) -> f64 {
    let x0 = x.floor();
    let at = |x: f64| green(picture, x as u32, y);
    at(x0) + (at(x0 + 1.0) - at(x0)) * (x - x0)
}

/// Neighbouring depths differ by less than a steep slope's.
fn is_smooth(depth: &DepthMap, x: u32, y: u32) -> bool {
    let here = depth[(x, y)];
    let near = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
    here > 0.0 && near.into_iter().all(|pixel| (depth[pixel] - here).abs() < 0.01 * here)
}

/// Mean grey difference between the left picture and the right one moved by the true disparity plus `shift_px`.
fn photometric_error(simulation: &Simulation, pair: &SimulatedFrame, shift_px: f64) -> f64 {
    let (width, height) = pair.left.size();
    let mut sum = 0.0;
    let mut pixels = 0_u32;
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let disparity = simulation.rig().disparity_px(f64::from(pair.depth[(x, y)])) + shift_px;
            let x_right = f64::from(x) - disparity;
            if is_smooth(&pair.depth, x, y) && x_right >= 0.0 {
                sum += (green(&pair.left, x, y) - green_between(&pair.right, x_right, y)).abs();
                pixels += 1;
            }
        }
    }
    assert!(pixels > width * height / 2, "only {pixels} pixels compared");
    sum / f64::from(pixels)
}

#[test]
fn the_right_picture_moved_by_the_true_disparity_is_the_left_one() {
    for scene in SceneKind::ALL {
        let simulation = Simulation::new(&lambertian(scene)).unwrap();
        let pair = simulation.frame(7).unwrap();
        let error = photometric_error(&simulation, &pair, 0.0);
        assert!(error < 2.0, "{scene}: {error} grey levels");
    }
}

#[test]
fn a_tenth_of_a_pixel_of_disparity_is_seen() {
    let simulation = Simulation::new(&lambertian(SceneKind::Liver)).unwrap();
    let pair = simulation.frame(7).unwrap();
    // the parabola through three errors has its least within a few hundredths of the truth
    let [before, at, after] = [-0.5, 0.0, 0.5].map(|shift| photometric_error(&simulation, &pair, shift));
    let least_px = 0.25 * (before - after) / (before - 2.0 * at + after);
    assert!(least_px.abs() < 0.05, "disparity is off by {least_px} px");
}

#[test]
fn material_points_lie_on_the_depth_map() {
    for scene in SceneKind::ALL {
        let simulation = Simulation::new(&small(scene)).unwrap();
        let pair = simulation.frame(20).unwrap();
        let camera = simulation.rig().left;
        let camera_from_world = pair.world_from_camera.inverse();
        let mut on_surface = 0;
        for (_, point) in &pair.points {
            let in_camera = camera_from_world * nalgebra::Point3::from(*point);
            let pixel = camera.project(&in_camera);
            let (x, y) = (pixel.x.round(), pixel.y.round());
            let inside = x >= 1.0 && y >= 1.0 && x < 159.0 && y < 119.0;
            if inside && is_smooth(&pair.depth, x as u32, y as u32) {
                let off_m = in_camera.z - f64::from(pair.depth[(x as u32, y as u32)]);
                // half a pixel on a slope is up to half the step to the neighbours
                on_surface += u32::from(off_m.abs() < 6e-4);
                assert!(off_m > -1.2e-3, "{scene}: a point floats {off_m} m before the surface");
            }
        }
        assert!(on_surface > 100, "{scene}: only {on_surface} points in view");
    }
}

#[test]
fn tissue_fills_the_picture_at_working_distance() {
    for scene in SceneKind::ALL {
        let simulation = Simulation::new(&small(scene)).unwrap();
        for frame in [0, 20, 39] {
            let depth = simulation.frame(frame).unwrap().depth;
            let mut sorted: Vec<f32> = depth.pixels().to_vec();
            sorted.sort_unstable_by(f32::total_cmp);
            let (nearest, median) = (sorted[0], sorted[sorted.len() / 2]);
            assert!(nearest > 0.03, "{scene} {frame}: nearest {nearest} m");
            assert!((0.04..0.09).contains(&median), "{scene} {frame}: median {median} m");
        }
    }
}

/// Mean square of the differences between neighbouring pixels.
fn sharpness(picture: &Rgb) -> f64 {
    let (width, height) = picture.size();
    let step = |x, y| (green(picture, x + 1, y) - green(picture, x, y)).powi(2);
    let sum: f64 =
        (0..height).flat_map(|y| (0..width - 1).map(move |x| (x, y))).map(|(x, y)| step(x, y)).sum();
    sum / f64::from(height * (width - 1))
}

#[test]
fn a_jerk_blurs_the_picture() {
    let calm = lambertian(SceneKind::Abdomen);
    let jerky = SceneConfig { exposure_ms: 16.0, jerk_mm: 25.0, jerk_frame: 10, ..calm };
    let simulation = Simulation::new(&jerky).unwrap();
    let at_rest = sharpness(&simulation.frame(8).unwrap().left);
    // fastest half way out
    let moving = sharpness(&simulation.frame(12).unwrap().left);
    assert!(moving < 0.6 * at_rest, "sharpness {moving} against {at_rest}");
}
