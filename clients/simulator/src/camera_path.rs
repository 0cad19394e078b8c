//! The scope's way: round a point inside the organ, across it and back.

use std::f64::consts::TAU;

use geometry::Pose;
use nalgebra::{Rotation2, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::SceneConfig;
use crate::deformation::smoother;

/// Share by which the speed swells in the middle of the run and sinks at its ends.
const EASE: f64 = 0.5;
const JERK_FRAMES: f64 = 5.0;
const JERK_TURN_RAD: f64 = 0.035;
/// Amplitudes and frequencies of the hand's tremor.
const TREMOR_MM: f64 = 0.12;
const TREMOR_RAD: f64 = 0.0012;
const TREMOR_HZ: [f64; 3] = [0.9, 1.7, 3.1];
const SAMPLES: usize = 2000;

/// A closed path of the left camera; the world is where it starts.
pub(crate) struct CameraPath {
    duration_s: f64,
    pivot_mm: f64,
    size_mm: f64,
    orientation: Rotation2<f64>,
    /// Phases of the loop's harmonics, of approach, roll and turn.
    phases: [f64; 4],
    tremor_phases: [[f64; 3]; 6],
    jerk: Option<Jerk>,
    world_from_start: Pose,
}

struct Jerk {
    direction_mm: Vector2<f64>,
    start_s: f64,
    duration_s: f64,
}

impl CameraPath {
    /// The path for a scene whose scope circles around a point `pivot_mm` before the first camera.
    pub fn new(config: &SceneConfig, pivot_mm: f64) -> Self {
        let mut random = Pcg64::seed_from_u64(config.seed ^ 0x5c09_e000);
        let mut phase = || random.random_range(0.0..TAU);
        let phases = [phase(), phase(), phase(), phase()];
        let tremor_phases = [(); 6].map(|()| [phase(), phase(), phase()]);
        let jerk_direction = Rotation2::new(phase()) * Vector2::x();
        let orientation = Rotation2::new(random.random_range(-0.5..0.5));
        let jerk = (config.jerk_mm > 0.0).then(|| Jerk {
            direction_mm: jerk_direction * config.jerk_mm,
            start_s: config.time_s(config.jerk_frame),
            duration_s: JERK_FRAMES / config.fps,
        });
        let duration_s = config.time_s(config.frames.max(2));
        let world_from_start = Pose::identity();
        let mut path = Self {
            duration_s,
            pivot_mm,
            size_mm: 1.0,
            orientation,
            phases,
            tremor_phases,
            jerk,
            world_from_start,
        };
        path.size_mm = path.fitted_size(config.path_mm, config.speed_max_mm_s);
        path.world_from_start = path.start_from_camera(0.0).inverse();
        path
    }

    /// Where the left camera is, `time_s` after the first frame.
    pub fn world_from_camera(&self, time_s: f64) -> Pose {
        self.world_from_start * self.start_from_camera(time_s)
    }

    /// The loop's scale for which neither its length nor its speed is exceeded.
    fn fitted_size(&self, path_mm: f64, speed_max_mm_s: f64) -> f64 {
        let at = |k: usize| self.loop_mm(k as f64 / SAMPLES as f64);
        let steps_mm: Vec<f64> = (0..SAMPLES).map(|k| (at(k + 1) - at(k)).norm()).collect();
        let length: f64 = steps_mm.iter().sum();
        let fastest = steps_mm.iter().copied().fold(0.0, f64::max) * SAMPLES as f64 / self.duration_s;
        (path_mm / length).min(speed_max_mm_s / fastest)
    }

    /// The closed way across the organ at a share of the run, a lying figure of eight.
    fn loop_mm(&self, share: f64) -> Vector2<f64> {
        let angle = TAU * share - EASE * (TAU * share).sin();
        let [rise, wobble, ..] = self.phases;
        let wave = |harmonic: f64, phase: f64| (harmonic * angle + phase).sin() - phase.sin();
        let eight = Vector2::new(angle.sin(), 0.42 * wave(2.0, 0.4 * rise.sin()));
        let wobbling = Vector2::new(0.07 * wave(3.0, wobble), 0.09 * wave(3.0, rise));
        self.orientation * (eight + wobbling) * self.size_mm
    }

    fn tremor(&self, axis: usize, time_s: f64) -> f64 {
        let waves = TREMOR_HZ.iter().zip(self.tremor_phases[axis]);
        waves.map(|(hz, phase)| (TAU * hz * time_s + phase).sin()).sum::<f64>() / 3.0
    }

    fn start_from_camera(&self, time_s: f64) -> Pose {
        let share = time_s / self.duration_s;
        let angle = TAU * share - EASE * (TAU * share).sin();
        let [_, approach, roll, turn] = self.phases;
        let jerk = self.jerk.as_ref().map_or(0.0, |jerk| jerk.at(time_s));
        let jerk_mm = self.jerk.as_ref().map_or_else(Vector2::zeros, |j| j.direction_mm * jerk);
        let across_mm = self.loop_mm(share) + jerk_mm;
        // small loops also roll and turn little
        let scale = (self.size_mm / 28.0).min(1.0);
        let swing = |amplitude: f64, phase: f64| amplitude * scale * (angle + phase).sin();
        let round_pivot = UnitQuaternion::from_euler_angles(
            across_mm.y / self.pivot_mm,
            -across_mm.x / self.pivot_mm,
            swing(0.09, roll),
        );
        let own_turn = UnitQuaternion::from_euler_angles(
            swing(0.04, turn) + TREMOR_RAD * self.tremor(3, time_s),
            swing(0.05, turn + 1.3) + TREMOR_RAD * self.tremor(4, time_s) + JERK_TURN_RAD * jerk,
            TREMOR_RAD * self.tremor(5, time_s),
        );
        let tremor_mm = Vector3::from_fn(|axis, _| TREMOR_MM * self.tremor(axis, time_s));
        let back_mm = Vector3::new(0.0, 0.0, -self.pivot_mm + swing(6.0, approach)) + tremor_mm;
        let pivot_m = Vector3::new(0.0, 0.0, self.pivot_mm * 1e-3);
        Translation3::from(pivot_m) * round_pivot * Translation3::from(back_mm * 1e-3) * own_turn
    }
}

impl Jerk {
    /// 0 at rest, 1 at the far end: out and back with smooth starts.
    fn at(&self, time_s: f64) -> f64 {
        let out = (time_s - self.start_s) / self.duration_s;
        smoother(out) - smoother(out - 1.0)
    }
}
