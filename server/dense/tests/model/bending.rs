//! A correction of the tracker's map: the model goes with it, and bends where it was seen at different times.

use dense::{DenseConfig, EncodingSteps, FrameCorrection, Surfel};
use geometry::Pose;
use nalgebra::{UnitQuaternion, Vector3};

use crate::scene::{Bench, Scene, WALL_M, at, config, deforming};

const STEPS: EncodingSteps =
    EncodingSteps { position_m: 2e-5, position_max_m: 20.0, node_m: 4e-6, affine: 1.0 / 4096.0 };
const WALL: Scene = Scene { ball: false, noise_m: 0.1e-3 };
const FRAMES: u32 = 21;

/// Where the camera is in a frame: it goes to the right, by more than it sees at once.
fn pose(frame: u32) -> Pose {
    at(7.5e-3 * f64::from(frame))
}

/// What the tracker takes the world for in a frame: it drifts away and turns.
fn drift(frame: u32) -> Pose {
    let way = f64::from(frame) / f64::from(FRAMES - 1);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.02 * way, 0.0));
    Pose::from_parts(Vector3::new(0.0, 1.5e-3 * way, 4e-3 * way).into(), turn)
}

fn pan(config: &DenseConfig) -> Bench {
    let mut bench = Bench::new(config).unwrap();
    for frame in 0..FRAMES {
        bench.fuse(frame, &(drift(frame) * pose(frame)), &WALL.shoot(&pose(frame), u64::from(frame)));
    }
    bench
}

/// What takes the drift out again, as of a keyframe every few frames.
fn corrections() -> Vec<FrameCorrection> {
    let at_frame = |frame| FrameCorrection { frame, after_from_before: drift(frame).inverse() };
    (0..FRAMES).step_by(4).map(at_frame).collect()
}

/// Mean distance of the surfels from the wall, and that of the farthest hundredth.
fn off_m(surfels: &[Surfel]) -> (f64, f64) {
    let mut off: Vec<f64> =
        surfels.iter().map(|surfel| (f64::from(surfel.position[2]) - WALL_M).abs()).collect();
    off.sort_by(f64::total_cmp);
    (off.iter().sum::<f64>() / off.len() as f64, off[off.len() * 99 / 100])
}

#[test]
fn drift_that_is_taken_out_of_the_map_is_taken_out_of_the_model() {
    let mut bench = pan(&deforming());
    let (drifted_m, _) = off_m(&bench.model.surfels().unwrap());
    bench.model.bend(&corrections()).unwrap();
    let (bent_m, farthest_m) = off_m(&bench.model.surfels().unwrap());
    eprintln!("off the wall: {drifted_m:.2e} m with drift, {bent_m:.2e} m bent, farthest {farthest_m:.2e} m");
    assert!(drifted_m > 1e-3, "{drifted_m}");
    assert!(bent_m < 0.35e-3 && farthest_m < 0.8e-3, "{bent_m} {farthest_m}");
}

#[test]
fn the_model_goes_on_where_it_was_bent_to() {
    let mut bench = pan(&deforming());
    bench.model.bend(&corrections()).unwrap();
    let before = bench.model.surfels().unwrap().len();
    let report = bench.fuse(FRAMES, &pose(FRAMES - 1), &WALL.shoot(&pose(FRAMES - 1), 99));
    let error_m = report.back_projection.unwrap().mean_m;
    eprintln!("back-projection {error_m:.2e} m, {} new surfels of {before}", report.lifted);
    assert_eq!(report.discarded, None);
    assert!(error_m < 0.2e-3, "{error_m}");
    assert!(f64::from(report.lifted) < 0.04 * before as f64, "no second layer: {}", report.lifted);
}

#[test]
fn a_share_after_the_other_leads_to_the_same_place() {
    let (mut at_once, mut in_shares) = (pan(&deforming()), pan(&deforming()));
    at_once.model.bend(&corrections()).unwrap();
    for _ in 0..8 {
        let share = |correction: &FrameCorrection| {
            let tangent = geometry::se3::log(&correction.after_from_before) / 8.0;
            FrameCorrection { after_from_before: geometry::se3::exp(&tangent), ..*correction }
        };
        in_shares.model.bend(&corrections().iter().map(share).collect::<Vec<_>>()).unwrap();
    }
    let (a, b) = (at_once.model.surfels().unwrap(), in_shares.model.surfels().unwrap());
    let apart = a.iter().zip(&b).map(|(a, b)| {
        assert_eq!(a.id, b.id);
        (0..3).map(|axis| (a.position[axis] - b.position[axis]).abs()).fold(0.0, f32::max)
    });
    let farthest_m = apart.fold(0.0, f32::max);
    eprintln!("farthest apart {farthest_m:.2e} m");
    assert!(farthest_m < 0.15e-3, "{farthest_m}");
}

#[test]
fn viewers_hear_of_a_bend_as_of_a_warp() {
    let mut bench = pan(&deforming());
    bench.model.take_changes(&STEPS).unwrap();
    bench.model.bend(&corrections()).unwrap();
    let changes = bench.model.take_changes(&STEPS).unwrap();
    let model = bench.model.surfels().unwrap();
    eprintln!("{} of {} surfels sent anew", changes.updated.len(), model.len());
    assert!(changes.added.is_empty() && changes.removed.is_empty());
    assert!(changes.updated.len() * 20 < model.len(), "the warp says it all: {}", changes.updated.len());
    let held = bench.model.held_surfels().unwrap();
    let bound_m = 1e-3 * deforming().publish.position_mm as f32;
    let apart = held.iter().zip(&model).map(|(held, own)| {
        assert_eq!(held.id, own.id);
        (0..3).map(|axis| (held.position[axis] - own.position[axis]).powi(2)).sum::<f32>().sqrt()
    });
    assert!(apart.fold(0.0, f32::max) <= 1.01 * bound_m);
}

#[test]
fn a_rigid_or_empty_model_and_no_correction_stay_as_they_are() {
    let mut rigid = pan(&config());
    let before = rigid.model.surfels().unwrap();
    rigid.model.bend(&corrections()).unwrap();
    assert_eq!(rigid.model.surfels().unwrap(), before);
    let mut deforming_model = pan(&deforming());
    let before = deforming_model.model.surfels().unwrap();
    deforming_model.model.bend(&[]).unwrap();
    assert_eq!(deforming_model.model.surfels().unwrap(), before);
    let mut empty = Bench::new(&deforming()).unwrap();
    empty.model.bend(&corrections()).unwrap();
    assert_eq!(empty.model.surfels().unwrap(), []);
}
