//! Measurements that are not numbers, or not there.

use crate::scene::{Bench, Scene, at, config};

const SCENE: Scene = Scene { ball: true, noise_m: 0.1e-3 };

#[test]
fn values_that_are_no_numbers_never_reach_the_model() {
    let mut bench = Bench::new(&config()).unwrap();
    let hostile = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.0, f32::MAX, f32::MIN_POSITIVE];
    for frame in 0..8 {
        let mut shot = SCENE.shoot(&at(0.0), u64::from(frame));
        let pixels = shot.depth.len();
        for (i, pixel) in (frame as usize..pixels).step_by(5).enumerate() {
            let value = hostile[i % hostile.len()];
            match i / hostile.len() % 3 {
                0 => shot.depth[pixel] = value,
                1 => shot.sigma_z[pixel] = value,
                _ => shot.normal[pixel] = [value; 4],
            }
        }
        bench.fuse(frame, &at(0.0), &shot);
    }
    let surfels = bench.model.surfels().unwrap();
    assert!(surfels.len() > 5000, "{}", surfels.len());
    for surfel in &surfels {
        let finite = surfel.position.iter().chain(&surfel.normal).all(|value| value.is_finite());
        assert!(finite && surfel.radius_m > 0.0 && surfel.weight > 0.0, "{surfel:?}");
        assert!((0.03..0.08).contains(&surfel.position[2]), "{surfel:?}");
    }
}

#[test]
fn a_frame_without_any_depth_leaves_the_model_alone() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..4 {
        bench.fuse(frame, &at(0.0), &SCENE.shoot(&at(0.0), u64::from(frame)));
    }
    let before = bench.model.surfels().unwrap();
    let mut blind = SCENE.shoot(&at(0.0), 0);
    blind.depth.fill(0.0);
    let report = bench.fuse(4, &at(0.0), &blind);
    assert_eq!((report.measured_pixels, report.registered, report.lifted), (0, 0, 0));
    assert_eq!(report.back_projection, None);
    assert_eq!(bench.model.surfels().unwrap(), before);
}
