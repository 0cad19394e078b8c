//! Colours under a light that moves with the camera.

use dense::DenseConfig;
use geometry::Pose;
use nalgebra::{Point2, Point3};

use crate::scene::{Bench, Scene, Shot, at, camera, config, evenly_lit, texture};

const WALL: Scene = Scene { ball: false, noise_m: 0.0 };

/// The picture as a lamp at the camera lights it, with the gain that the camera chooses.
fn lit(mut shot: Shot, gain: f64) -> Shot {
    let camera = camera();
    let columns = camera.width_px as usize;
    for (pixel, color) in shot.color.iter_mut().enumerate() {
        let at = Point2::new((pixel % columns) as f64, (pixel / columns) as f64);
        let point = camera.back_project(&at, f64::from(shot.depth[pixel])).coords;
        let cosine = point.z / point.norm();
        let light = gain * 0.06f64.powi(2) / point.norm_squared() * cosine.powi(3);
        let [red, green, blue, alpha] = color.to_le_bytes();
        let [red, green, blue] = [red, green, blue].map(|level| (0.8 * f64::from(level) * light) as u8);
        *color = u32::from_le_bytes([red, green, blue, alpha]);
    }
    shot
}

/// The camera goes 30 mm to the side, 12 mm nearer, and back, adapting its gain.
fn path(frame: u32) -> (Pose, f64) {
    let phase = (f64::from(frame) / 40.0 * std::f64::consts::PI).sin();
    (Pose::translation(0.03 * phase, 0.0, 0.012 * phase), 1.0 - 0.3 * phase)
}

/// Root of the mean square difference of the model's red from the truth, after the best gain, in levels.
fn unevenness(config: &DenseConfig) -> f64 {
    let mut bench = Bench::new(config).unwrap();
    for frame in 0..40 {
        let (pose, gain) = path(frame);
        bench.fuse(frame, &pose, &lit(WALL.shoot(&pose, u64::from(frame)), gain));
    }
    let surfels = bench.model.surfels().unwrap();
    let pairs = surfels.iter().map(|surfel| {
        let truth = texture(&Point3::from(surfel.position.map(f64::from)));
        (f64::from(surfel.color[0]), f64::from(truth[0]))
    });
    let pairs: Vec<(f64, f64)> = pairs.collect();
    let sum = |value: fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>();
    let gain = sum(|(found, truth)| found * truth) / sum(|(found, _)| found * found);
    let squares: f64 = pairs.iter().map(|(found, truth)| (gain * found - truth).powi(2)).sum();
    (squares / pairs.len() as f64).sqrt()
}

#[test]
fn a_light_that_moves_with_the_scope_leaves_no_seams() {
    let (before, after) = (unevenness(&evenly_lit()), unevenness(&config()));
    eprintln!("{before:.1} levels without the light's fall-off, {after:.1} with it");
    assert!(after < 5.0 && after * 3.0 < before, "{before} -> {after}");
}

#[test]
fn a_highlight_that_is_not_saturated_hardly_changes_a_colour() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..6 {
        bench.fuse(frame, &at(0.0), &WALL.shoot(&at(0.0), 0));
    }
    let before = bench.model.surfels().unwrap();
    let mut glossy = WALL.shoot(&at(0.0), 0);
    for color in glossy.color.iter_mut().skip(9600).take(800) {
        *color = 0xfff0_f0f0;
    }
    bench.fuse(6, &at(0.0), &glossy);
    let after = bench.model.surfels().unwrap();
    let off = |(old, new): (&dense::Surfel, &dense::Surfel)| old.color[2].abs_diff(new.color[2]);
    let worst = before.iter().zip(&after).map(off).max().unwrap();
    assert!(worst <= 6, "{worst}");
}
