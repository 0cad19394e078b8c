//! The warp over frames: what deforms is followed, what does not stays.

use dense::{DenseConfig, FusionReport};
use nalgebra::{Point3, Vector3};

use crate::scene::{Bench, Shot, WALL_M, at, camera, config, deforming};

/// A wall with a bump of 10 mm (standard deviation) that grows out of it.
#[derive(Clone, Copy)]
struct Bump {
    height_m: f64,
    center_x_m: f64,
}

impl Bump {
    /// Height of the wall at a place, towards the camera.
    fn at(&self, x: f64, y: f64) -> f64 {
        let square = (x - self.center_x_m).powi(2) + y * y;
        self.height_m * (-0.5 * square / 0.01f64.powi(2)).exp()
    }

    /// A picture from a camera at `camera_x_m` that looks along z, with noise of 0.1 mm.
    fn shoot(&self, camera_x_m: f64, seed: u32) -> Shot {
        let mut shot = Shot { depth: vec![], sigma_z: vec![], normal: vec![], color: vec![] };
        let camera = camera();
        for pixel in 0..camera.width_px * camera.height_px {
            let (x, y) = (f64::from(pixel % camera.width_px), f64::from(pixel / camera.width_px));
            let ray = [(x - camera.cx_px) / camera.fx_px, (y - camera.cy_px) / camera.fy_px];
            let mut depth = WALL_M;
            for _ in 0..8 {
                depth = WALL_M - self.at(camera_x_m + ray[0] * depth, ray[1] * depth);
            }
            let (wx, wy) = (camera_x_m + ray[0] * depth, ray[1] * depth);
            let slope = |dx: f64, dy: f64| (self.at(wx + dx, wy + dy) - self.at(wx - dx, wy - dy)) / 2e-4;
            let normal = -Vector3::new(slope(1e-4, 0.0), slope(0.0, 1e-4), 1.0).normalize();
            let noise =
                f64::from(hash(pixel ^ seed.wrapping_mul(0x9E37_79B9)) >> 8) / f64::from(1 << 24) - 0.5;
            shot.depth.push((depth + 3e-4 * noise) as f32);
            shot.sigma_z.push(1e-4);
            shot.normal.push([normal.x as f32, normal.y as f32, normal.z as f32, 1.0]);
            shot.color.push(0xff80_4020);
        }
        shot
    }
}

fn hash(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Frames of a bump that grows by `growth_m` a frame from the fifth on, up to frame `frames`.
fn watch(bench: &mut Bench, growth_m: f64, center_x_m: f64, frames: u32) -> Vec<FusionReport> {
    let bump = |frame: u32| Bump { height_m: growth_m * f64::from(frame.saturating_sub(4)), center_x_m };
    (0..frames).map(|frame| bench.fuse(frame, &at(0.0), &bump(frame).shoot(0.0, frame))).collect()
}

/// Points of the flat wall, on a grid of 4 mm.
fn wall_points() -> Vec<(u32, Point3<f64>)> {
    let point = |i: u32| {
        let (column, row) = (i % 15, i / 15);
        Point3::new(4e-3 * f64::from(column) - 0.028, 4e-3 * f64::from(row) - 0.02, WALL_M)
    };
    (0..165).map(|i| (i, point(i))).collect()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = values.map(|value| value * value).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_scene_that_does_not_deform_does_not_move_the_nodes() {
    let mut bench = Bench::new(&deforming()).unwrap();
    let still = Bump { height_m: 2e-3, center_x_m: 0.0 };
    bench.fuse(0, &at(0.0), &still.shoot(0.0, 0));
    for frame in 1..5 {
        bench.fuse(frame, &at(0.0), &still.shoot(0.0, frame));
    }
    let before = bench.model.nodes().unwrap();
    for frame in 5..25 {
        bench.fuse(frame, &at(0.0), &still.shoot(0.0, frame));
    }
    let after = bench.model.nodes().unwrap();
    let ways = before.iter().filter_map(|node| {
        let now = after.iter().find(|now| now.id == node.id)?;
        Some((now.position - node.position).norm())
    });
    let rms_m = rms(ways);
    eprintln!("{} nodes moved by {:.4} mm", before.len(), rms_m * 1e3);
    assert!(before.len() > 100 && rms_m < 0.05e-3, "{rms_m}");
}

#[test]
fn a_growing_bump_is_followed() {
    let run = |config: &DenseConfig| {
        let mut bench = Bench::new(config).unwrap();
        watch(&mut bench, 0.0, 0.0, 4);
        bench.model.follow(&wall_points()).unwrap();
        let reports = (4..24u32).map(|frame| {
            let bump = Bump { height_m: 0.2e-3 * f64::from(frame - 4), center_x_m: 0.0 };
            bench.fuse(frame, &at(0.0), &bump.shoot(0.0, frame))
        });
        let errors: Vec<f64> = reports.map(|report| report.back_projection.unwrap().mean_m).collect();
        let bump = Bump { height_m: 0.2e-3 * 19.0, center_x_m: 0.0 };
        let points = bench.model.followed().unwrap();
        let off = points.iter().map(|(_, point)| point.z - (WALL_M - bump.at(point.x, point.y)));
        (errors.iter().sum::<f64>() / errors.len() as f64, rms(off))
    };
    let (error_m, off_m) = run(&deforming());
    let (rigid_error_m, _) = run(&config());
    eprintln!("back-projection {error_m:.2e} m, rigid {rigid_error_m:.2e} m; points off {off_m:.2e} m");
    assert!(error_m < 0.13e-3, "{error_m}");
    assert!(off_m < 0.18e-3, "{off_m}");
    assert!(error_m < 0.6 * rigid_error_m, "{rigid_error_m}");
}

#[test]
fn what_is_not_seen_keeps_its_shape() {
    let mut bench = Bench::new(&deforming()).unwrap();
    let still = Bump { height_m: 0.0, center_x_m: 0.0 };
    let pan = |frame: u32| 0.002 * f64::from(frame);
    for frame in 0..20 {
        bench.fuse(frame, &at(pan(frame)), &still.shoot(pan(frame), frame));
    }
    let before = bench.model.surfels().unwrap();
    // the camera has gone 38 mm to the right, where a bump now grows
    for frame in 20..40u32 {
        let bump = Bump { height_m: 0.15e-3 * f64::from(frame - 20), center_x_m: 0.05 };
        bench.fuse(frame, &at(pan(19)), &bump.shoot(pan(19), frame));
    }
    let after = bench.model.surfels().unwrap();
    let unseen = before.iter().filter(|surfel| surfel.position[0] < -0.012);
    let moved = unseen.filter_map(|surfel| {
        let now = after.iter().find(|now| now.id == surfel.id)?;
        let way: f32 = (0..3).map(|axis| (now.position[axis] - surfel.position[axis]).powi(2)).sum();
        Some(f64::from(way).sqrt())
    });
    let ways: Vec<f64> = moved.collect();
    let largest = ways.iter().copied().fold(0.0, f64::max);
    eprintln!("{} unseen surfels moved by at most {largest:.2e} m", ways.len());
    assert!(ways.len() > 1000 && largest < 0.02e-3, "{largest}");
}
