//! Averaging, density, removal, stability and rejection.

use std::collections::BTreeMap;

use dense::{DiscardReason, Surfel};
use nalgebra::Point3;

use crate::scene::{Bench, Scene, WALL_M, at, config, evenly_lit, texture};

const NOISY: Scene = Scene { ball: false, noise_m: 0.3e-3 };

/// A camera that sways by +-2 mm.
fn sway(frame: u32) -> geometry::Pose {
    at(2e-3 * (f64::from(frame) * 0.3).sin())
}

fn rmse_to_wall(surfels: &[Surfel]) -> f64 {
    let squares = surfels.iter().map(|surfel| (f64::from(surfel.position[2]) - WALL_M).powi(2));
    (squares.sum::<f64>() / surfels.len() as f64).sqrt()
}

#[test]
fn a_plane_seen_with_noise_fuses_to_an_error_below_the_noise() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..20 {
        let report = bench.fuse(frame, &sway(frame), &NOISY.shoot(&sway(frame), u64::from(frame)));
        assert_eq!(report.discarded, None);
    }
    let surfels = bench.model.surfels().unwrap();
    let rmse = rmse_to_wall(&surfels);
    eprintln!("{} surfels, rmse {:.4} mm", surfels.len(), rmse * 1e3);
    assert!(rmse < 0.4 * NOISY.noise_m, "{rmse}");
    let off = surfels.iter().map(|surfel| 1.0 + f64::from(surfel.normal[2])).fold(0.0, f64::max);
    assert!(off < 1e-3, "{off}");
}

#[test]
fn the_surfels_of_a_static_scene_converge_to_the_density_of_the_point_grid() {
    let mut bench = Bench::new(&config()).unwrap();
    let counts: Vec<u32> = (0..30)
        .map(|frame| bench.fuse(frame, &at(0.0), &NOISY.shoot(&at(0.0), u64::from(frame))).surfels)
        .collect();
    eprintln!("{counts:?}");
    let (late, end) = (f64::from(counts[19]), f64::from(counts[29]));
    assert!((end / late - 1.0).abs() < 0.03, "{counts:?}");
    let area_mm2 = (160.0 * 60.0 / 140.0) * (120.0 * 60.0 / 140.0);
    let per_cell = end * config().surfel_spacing_mm.powi(2) / area_mm2;
    eprintln!("{per_cell} per cell");
    assert!((0.5..1.6).contains(&per_cell), "{per_cell}");
}

#[test]
fn a_surfel_takes_the_colour_of_its_place() {
    let mut bench = Bench::new(&evenly_lit()).unwrap();
    let scene = Scene { ball: true, noise_m: 0.0 };
    for frame in 0..8 {
        bench.fuse(frame, &sway(frame), &scene.shoot(&sway(frame), 0));
    }
    for surfel in bench.model.surfels().unwrap() {
        let expected = texture(&Point3::from(surfel.position.map(f64::from)));
        let off = (0..3).map(|i| surfel.color[i].abs_diff(expected[i])).max().unwrap();
        assert!(off <= 6, "{surfel:?} {expected:?}");
    }
}

#[test]
fn a_highlight_leaves_the_colour_alone() {
    let mut bench = Bench::new(&config()).unwrap();
    let scene = Scene { ball: false, noise_m: 0.0 };
    for frame in 0..3 {
        bench.fuse(frame, &at(0.0), &scene.shoot(&at(0.0), 0));
    }
    let before = bench.model.surfels().unwrap();
    for frame in 3..6 {
        let mut shot = scene.shoot(&at(0.0), 0);
        shot.color.fill(0x00ff_ffff);
        bench.fuse(frame, &at(0.0), &shot);
    }
    let after = bench.model.surfels().unwrap();
    for old in before {
        let same = after.iter().find(|surfel| surfel.id == old.id).unwrap();
        assert_eq!(same.color, old.color);
    }
}

#[test]
fn the_surfels_of_a_removed_object_vanish() {
    let mut bench = Bench::new(&config()).unwrap();
    let (with, without) = (Scene { ball: true, ..NOISY }, NOISY);
    let on_ball = |bench: &Bench| {
        bench
            .model
            .surfels()
            .unwrap()
            .iter()
            .filter(|surfel| f64::from(surfel.position[2]) < WALL_M - 4e-3)
            .count()
    };
    for frame in 0..15 {
        bench.fuse(frame, &at(0.0), &with.shoot(&at(0.0), u64::from(frame)));
    }
    let before = on_ball(&bench);
    for frame in 15..40 {
        bench.fuse(frame, &at(0.0), &without.shoot(&at(0.0), u64::from(frame)));
    }
    let after = on_ball(&bench);
    eprintln!("{before} -> {after}");
    assert!(before > 500 && after * 100 < before, "{before} -> {after}");
}

#[test]
fn a_surface_that_comes_nearer_leaves_no_second_layer_behind() {
    let mut bench = Bench::new(&config()).unwrap();
    let nearer = geometry::Pose::translation(0.0, 0.0, -2.5e-3);
    for frame in 0..15 {
        bench.fuse(frame, &at(0.0), &NOISY.shoot(&at(0.0), u64::from(frame)));
    }
    // the same picture from a camera said to be farther back: the wall stands 2.5 mm nearer to where it was
    for frame in 15..40 {
        bench.fuse(frame, &nearer, &NOISY.shoot(&at(0.0), u64::from(frame)));
    }
    let surfels = bench.model.surfels().unwrap();
    let inner = |surfel: &&Surfel| surfel.position[0].abs() < 0.025 && surfel.position[1].abs() < 0.018;
    let (left, all) = surfels.iter().filter(inner).fold((0, 0), |(left, all), surfel| {
        (left + usize::from(f64::from(surfel.position[2]) > WALL_M - 1e-3), all + 1)
    });
    eprintln!("{left} of {all} left behind");
    assert!(left * 50 < all, "{left} of {all}");
}

#[test]
fn surfels_out_of_view_stay_if_stable_and_go_if_not() {
    let mut bench = Bench::new(&config()).unwrap();
    let wait = config().fusion.unseen_frames_max;
    bench.fuse(0, &at(0.0), &NOISY.shoot(&at(0.0), 0));
    let fleeting = bench.model.surfel_counts();
    assert_eq!(fleeting.1, 0);
    for frame in 1..=wait + 2 {
        bench.fuse(frame, &at(1.0), &NOISY.shoot(&at(1.0), u64::from(frame)));
    }
    assert!(bench.model.surfels().unwrap().iter().all(|surfel| surfel.position[0] > 0.5));
    let seen = bench.model.surfels().unwrap().len();
    for frame in 20..20 + wait + 2 {
        bench.fuse(frame, &at(0.0), &NOISY.shoot(&at(0.0), u64::from(frame)));
    }
    let kept = bench.model.surfels().unwrap().iter().filter(|surfel| surfel.position[0] > 0.5).count();
    assert!(kept * 100 >= seen * 97, "{kept} of {seen}");
}

#[test]
fn spikes_that_nobody_confirms_are_culled() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..20 {
        let mut shot = NOISY.shoot(&at(0.0), u64::from(frame));
        for spike in 0..200 {
            let pixel = (frame as usize * 7919 + spike * 104_729) % shot.depth.len();
            shot.depth[pixel] -= 8e-3;
        }
        bench.fuse(frame, &at(0.0), &shot);
    }
    let surfels = bench.model.surfels().unwrap();
    let spikes = surfels.iter().filter(|surfel| f64::from(surfel.position[2]) < WALL_M - 4e-3).count();
    assert!(spikes * 1000 < surfels.len(), "{spikes} of {}", surfels.len());
}

#[test]
fn ids_are_unique_sorted_and_stay_with_their_place() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..10 {
        bench.fuse(frame, &sway(frame), &NOISY.shoot(&sway(frame), u64::from(frame)));
    }
    let before: BTreeMap<u32, [f32; 3]> =
        bench.model.surfels().unwrap().iter().map(|surfel| (surfel.id, surfel.position)).collect();
    for frame in 10..25 {
        bench.fuse(frame, &sway(frame), &NOISY.shoot(&sway(frame), u64::from(frame)));
    }
    let surfels = bench.model.surfels().unwrap();
    assert!(surfels.windows(2).all(|pair| pair[0].id < pair[1].id));
    let kept: Vec<_> = surfels.iter().filter_map(|surfel| Some((surfel, before.get(&surfel.id)?))).collect();
    eprintln!("{} of {} kept", kept.len(), before.len());
    assert!(kept.len() * 10 > before.len() * 9, "{} of {}", kept.len(), before.len());
    for (surfel, old) in kept {
        let moved: f32 = (0..3).map(|i| (surfel.position[i] - old[i]).powi(2)).sum::<f32>().sqrt();
        assert!(moved < 1e-3, "{surfel:?} was at {old:?}");
    }
}

#[test]
fn the_back_projection_error_is_that_of_the_noise() {
    let mut bench = Bench::new(&config()).unwrap();
    let mut last = None;
    for frame in 0..12 {
        last = bench.fuse(frame, &at(0.0), &NOISY.shoot(&at(0.0), u64::from(frame))).back_projection;
    }
    let error = last.unwrap();
    eprintln!("{error:?}");
    // of a normal distribution: mean 0.798, median 0.674, 95 % below 1.96 standard deviations
    let in_sigmas = |metres: f64| metres / NOISY.noise_m;
    assert!((0.75..0.95).contains(&in_sigmas(error.mean_m)), "{error:?}");
    assert!((0.62..0.80).contains(&in_sigmas(error.median_m)), "{error:?}");
    assert!((0.95..1.15).contains(&in_sigmas(error.rmse_m)), "{error:?}");
    assert!((1.85..2.25).contains(&in_sigmas(error.p95_m)), "{error:?}");
    assert!(error.coverage > 0.99, "{error:?}");
}

#[test]
fn a_frame_far_from_the_model_is_not_fused_until_the_scene_proves_changed() {
    let mut bench = Bench::new(&config()).unwrap();
    for frame in 0..5 {
        bench.fuse(frame, &at(0.0), &NOISY.shoot(&at(0.0), u64::from(frame)));
    }
    let before = bench.model.surfels().unwrap();
    let wrong = geometry::Pose::translation(0.0, 0.0, 0.015);
    let patience = config().rejection.frames_in_row_max;
    for frame in 5..5 + patience {
        let report = bench.fuse(frame, &wrong, &NOISY.shoot(&at(0.0), u64::from(frame)));
        assert_eq!((report.discarded, report.lifted), (Some(DiscardReason::BackProjectionError), 0));
    }
    assert_eq!(bench.model.surfels().unwrap(), before);
    let report = bench.fuse(5 + patience, &wrong, &NOISY.shoot(&at(0.0), 99));
    assert_eq!(report.discarded, None);
    assert!(report.lifted > 0);
}

#[test]
fn two_runs_agree_in_every_bit() {
    let run = || {
        let mut bench = Bench::new(&config()).unwrap();
        let scene = Scene { ball: true, ..NOISY };
        let reports: Vec<_> = (0..12)
            .map(|frame| bench.fuse(frame, &sway(frame), &scene.shoot(&sway(frame), u64::from(frame))))
            .collect();
        (reports, bench.model.surfels().unwrap())
    };
    assert!(run() == run());
}

#[test]
fn the_model_grows_to_its_limit_and_counts_what_it_refuses() {
    let limited = dense::DenseConfig { surfel_capacity: 1000, surfel_limit: 3000, ..config() };
    let mut bench = Bench::new(&limited).unwrap();
    let report = bench.fuse(0, &at(0.0), &NOISY.shoot(&at(0.0), 0));
    assert_eq!((report.lifted, report.surfels), (3000, 3000));
    assert!(report.refused > 1000, "{report:?}");
    let grown = dense::DenseConfig { surfel_capacity: 1000, ..config() };
    let mut free = Bench::new(&grown).unwrap();
    let first = free.fuse(0, &at(0.0), &NOISY.shoot(&at(0.0), 0));
    assert_eq!(first.refused, 0);
    let mut plenty = Bench::new(&config()).unwrap();
    plenty.fuse(0, &at(0.0), &NOISY.shoot(&at(0.0), 0));
    for frame in 1..6 {
        let pose = at(0.02 * f64::from(frame));
        let shot = NOISY.shoot(&pose, u64::from(frame));
        assert_eq!(free.fuse(frame, &pose, &shot), plenty.fuse(frame, &pose, &shot));
    }
    assert!(free.model.surfels().unwrap() == plenty.model.surfels().unwrap(), "growth changes nothing");
}
