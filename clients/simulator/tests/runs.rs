//! Runs as a whole: determinism, motion, truth.

mod common;

use std::process::Command;

use common::small;
use geometry::DepthMap;
use nalgebra::{Point3, Vector3};
use simulator::{SceneConfig, SceneKind, SimulatedFrame, Simulation, SimulatorError, TruthMesh};

fn displacement_m(from: &SimulatedFrame, to: &SimulatedFrame) -> Vec<f64> {
    let pairs = from.points.iter().zip(&to.points);
    pairs.map(|((_, a), (_, b))| (Vector3::from(*b) - Vector3::from(*a)).norm()).collect()
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let config = small(SceneKind::Heart);
    let on_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let simulation = Simulation::new(&config).unwrap();
            (simulation.frame(9).unwrap(), simulation.truth_mesh())
        })
    };
    assert!(on_threads(1) == on_threads(3));
}

#[test]
fn another_seed_gives_another_organ() {
    let config = small(SceneKind::Liver);
    let first = Simulation::new(&config).unwrap();
    let second = Simulation::new(&SceneConfig { seed: config.seed + 1, ..config }).unwrap();
    assert_ne!(first.truth_mesh().rest_m, second.truth_mesh().rest_m);
    assert_ne!(first.frame(0).unwrap().left, second.frame(0).unwrap().left);
}

#[test]
fn the_world_is_the_first_left_camera_and_the_scope_comes_back_to_it() {
    let config = small(SceneKind::Liver);
    let simulation = Simulation::new(&SceneConfig { frames: 300, ..config }).unwrap();
    let at = |frame| simulation.world_from_camera(frame).translation.vector;
    assert!(at(0).norm() < 1e-12);
    assert!(at(299).norm() < 2e-3, "ends {} m from the start", at(299).norm());
    let path_m: f64 = (0..299).map(|k| (at(k + 1) - at(k)).norm()).sum();
    assert!((0.15..0.25).contains(&path_m), "path of {path_m} m");
}

#[test]
fn a_short_run_goes_no_faster_than_allowed() {
    let config = small(SceneKind::Kidney);
    let simulation = Simulation::new(&config).unwrap();
    let at = |frame| simulation.world_from_camera(frame).translation.vector;
    let fastest_m_s = (0..39).map(|k| (at(k + 1) - at(k)).norm() * config.fps).fold(0.0, f64::max);
    // roll, approach and tremor add a little to the speed of the loop itself
    assert!(fastest_m_s < 1.25e-3 * config.speed_max_mm_s, "{fastest_m_s} m/s");
}

#[test]
fn nothing_moves_in_a_rigid_scene() {
    let config = small(SceneKind::Heart);
    let simulation =
        Simulation::new(&SceneConfig { deformation_mm: 0.0, respiration_mm: 0.0, ..config }).unwrap();
    let frames = [0, 13, 39].map(|frame| simulation.frame(frame).unwrap());
    assert_eq!(frames[0].points, frames[1].points);
    assert_eq!(frames[0].points, frames[2].points);
    assert!(simulation.truth_mesh().pushes.is_empty());
}

#[test]
fn breathing_has_a_switch_of_its_own() {
    let config = small(SceneKind::Liver);
    let breathing = SceneConfig { deformation_mm: 0.0, respiration_mm: 2.0, ..config };
    let simulation = Simulation::new(&breathing).unwrap();
    // 0.25 Hz: after 1.3 s the tissue is on its way to the peak.
    let [first, last] = [0, 39].map(|frame| simulation.frame(frame).unwrap());
    let moved_mm = greatest(&displacement_m(&first, &last)) * 1e3;
    assert!(moved_mm > 0.5 && moved_mm <= 2.0 + 1e-9, "{moved_mm} mm");
    assert!(simulation.truth_mesh().pushes.is_empty());
}

#[test]
fn pushes_are_two_thirds_to_all_of_the_amplitude() {
    let config = small(SceneKind::Liver);
    let simulation = Simulation::new(&config).unwrap();
    let truth = simulation.truth_mesh();
    assert!(truth.pushes.len() >= 4, "{} pushes in 1.3 s", truth.pushes.len());
    for push in &truth.pushes {
        let size_mm = push.displacement_m.norm() * 1e3;
        assert!((2.0 - 1e-9..=3.0).contains(&size_mm), "push of {size_mm} mm");
        assert!(truth.rest_m.contains(&push.centre_m), "a push starts at a vertex");
    }
}

#[test]
fn one_push_moves_the_material_by_its_amplitude() {
    let calm = small(SceneKind::Abdomen);
    let config = SceneConfig { respiration_mm: 0.0, push_interval_s: 1e6, points: 5000, ..calm };
    let simulation = Simulation::new(&config).unwrap();
    let [first, last] = [0, 39].map(|frame| simulation.frame(frame).unwrap());
    let moved_m = greatest(&displacement_m(&first, &last));
    let push_m = simulation.truth_mesh().pushes[0].displacement_m.norm();
    assert!(moved_m <= push_m && moved_m > 0.9 * push_m, "{moved_m} m of {push_m} m");
}

#[test]
fn the_phantom_beats_periodically() {
    let config = small(SceneKind::Phantom);
    let simulation = Simulation::new(&config).unwrap();
    let [rest, peak, period_later] = [0, 15, 30].map(|frame| simulation.frame(frame).unwrap());
    let peak_mm = greatest(&displacement_m(&rest, &peak)) * 1e3;
    assert!(peak_mm > 0.9 * config.deformation_mm && peak_mm <= config.deformation_mm, "{peak_mm} mm");
    assert!(greatest(&displacement_m(&rest, &period_later)) < 1e-9);
}

/// The truth mesh's own formula, written out once more: where vertex `i` is at a frame.
fn vertex_at(truth: &TruthMesh, i: usize, frame: usize) -> Point3<f64> {
    let time_s = truth.times_s[frame];
    let swing = 0.5 * (1.0 - (std::f64::consts::TAU * truth.breathing_hz * time_s).cos());
    let mut at = truth.rest_m[i] + truth.breathing_m * (f64::from(truth.breathing_gain[i]) * swing);
    for push in &truth.pushes {
        let x = ((time_s - push.start_s) / push.duration_s).clamp(0.0, 1.0);
        let progress = 6.0 * x.powi(5) - 15.0 * x.powi(4) + 10.0 * x.powi(3);
        let r = ((truth.rest_m[i] - push.centre_m).norm() / push.radius_m).min(1.0);
        at += push.displacement_m * (progress * (1.0 - r).powi(4) * (4.0 * r + 1.0));
    }
    at
}

/// Depth between pixels: faces are planes, whose inverse depth is linear on the picture.
fn depth_between(depth: &DepthMap, x: f64, y: f64) -> Option<f64> {
    let inverse = |dx, dy| Some(1.0 / f64::from(*depth.get(x as i64 + dx, y as i64 + dy)?));
    let (tx, ty) = (x.fract(), y.fract());
    let top = inverse(0, 0)? * (1.0 - tx) + inverse(1, 0)? * tx;
    let bottom = inverse(0, 1)? * (1.0 - tx) + inverse(1, 1)? * tx;
    Some(1.0 / (top * (1.0 - ty) + bottom * ty))
}

#[test]
fn the_depth_map_shows_the_truth_mesh_where_the_pose_puts_it() {
    for (scene, frame) in [(SceneKind::Liver, 25), (SceneKind::Phantom, 15)] {
        let simulation = Simulation::new(&small(scene)).unwrap();
        let truth = simulation.truth_mesh();
        let shown = simulation.frame(frame as u32).unwrap();
        let camera_from_world = shown.world_from_camera.inverse();
        let mut errors_m: Vec<f64> = (0..truth.rest_m.len())
            .filter(|&i| truth.seen_frames[i] == 40)
            .filter_map(|i| {
                let in_camera = camera_from_world * vertex_at(&truth, i, frame);
                let pixel = simulation.rig().left.project(&in_camera);
                Some((depth_between(&shown.depth, pixel.x, pixel.y)? - in_camera.z).abs())
            })
            .collect();
        errors_m.sort_unstable_by(f64::total_cmp);
        assert!(errors_m.len() > 500, "{scene}: {} vertices always seen", errors_m.len());
        let (median, most) = (errors_m[errors_m.len() / 2], errors_m[errors_m.len() * 19 / 20]);
        // a vertex is a corner of the mesh: interpolating across it cuts it by some hundredths of a millimetre
        assert!(median < 5e-5 && most < 3e-4, "{scene}: median {median} m, 95 % {most} m");
    }
}

#[test]
fn a_frame_past_the_end_is_refused() {
    let simulation = Simulation::new(&small(SceneKind::Liver)).unwrap();
    let refused = simulation.frame(40);
    assert!(matches!(refused, Err(SimulatorError::NoSuchFrame { frame: 40, frames: 40 })));
}

#[test]
fn a_refusal_names_the_key_and_the_range() {
    let config = SceneConfig { baseline_mm: f64::NAN, ..small(SceneKind::Liver) };
    let message = Simulation::new(&config).err().unwrap().to_string();
    assert_eq!(message, "simulate.baseline_mm = NaN is outside 1 to 20");
    let config = SceneConfig { width_px: 1 << 20, ..small(SceneKind::Liver) };
    assert!(Simulation::new(&config).is_err());
}

#[test]
fn scenes_are_known_by_their_names() {
    for kind in SceneKind::ALL {
        assert_eq!(kind.to_string().parse::<SceneKind>().unwrap(), kind);
    }
    assert!("spleen".parse::<SceneKind>().unwrap_err().to_string().contains("spleen"));
}

/// Prints shapes and dtypes of the archive.
const READ_WITH_NUMPY: &str = r"
import sys, numpy as np
z = np.load(sys.argv[1])
for key in z.files:
    print(key, z[key].dtype, z[key].shape)
assert int(z['n_organ']) > 0 and float(z['resp_hz']) == 0.25
assert z['faces'].max() < len(z['v0'])
d = np.linalg.norm(z['v0'].astype(float) - z['push_centre'][0], axis=1)
assert d.min() == 0.0
";

#[test]
fn the_truth_mesh_opens_with_numpy() {
    let python = std::env::var("MIS_SLAM_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_numpy = Command::new(&python).args(["-c", "import numpy"]).output();
    if !has_numpy.is_ok_and(|run| run.status.success()) {
        eprintln!("skipped: {python} with numpy not found (set MIS_SLAM_PYTHON)");
        return;
    }
    let truth = Simulation::new(&small(SceneKind::Liver)).unwrap().truth_mesh();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth_mesh.npz");
    std::fs::write(&path, truth.to_npz().unwrap()).unwrap();
    let run = Command::new(&python).args(["-c", READ_WITH_NUMPY]).arg(&path).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let listing = String::from_utf8(run.stdout).unwrap();
    let vertices = truth.rest_m.len();
    for line in [
        format!("v0 float32 ({vertices}, 3)"),
        format!("faces int32 ({}, 3)", truth.faces.len()),
        format!("seen_frames uint16 ({vertices},)"),
        "n_organ int64 ()".to_owned(),
        "times float64 (40,)".to_owned(),
        "stamps int64 (40,)".to_owned(),
        format!("push_centre float64 ({}, 3)", truth.pushes.len()),
    ] {
        assert!(listing.lines().any(|printed| printed == line), "{line:?} not in\n{listing}");
    }
}
