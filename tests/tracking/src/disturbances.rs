//! Blackout, jerk and cut: how soon the tracker finds itself again, in 20 scenes.

use std::ops::Range;

use geometry::{Pose, Raster};
use simulator::{SceneConfig, SceneKind};

use crate::Error;
use crate::footage::{Footage, progress, rigid};
use crate::row::{Measured, Row};
use crate::run::{Bench, Pair, Recording};
use crate::settings::Settings;

const SEEDS: u64 = 20;
const FRAMES: u32 = 70;
const JERK_MM: f64 = 25.0;
/// The jerk leads to the side in 5 frames and back in 5.
const JERK: Range<usize> = 20..30;
const CUT: Range<usize> = 42..57;
/// Frames after the first usable one by which the pose must be known.
const PATIENCE_FRAMES: usize = 10;
/// A pose further off than this is none.
const POSITION_ERROR_MAX_M: f64 = 2e-3;

/// The three rows.
pub fn rows() -> Vec<Row> {
    let target = "recovered within 10 frames in 20 of 20 seeds, map kept";
    let anchor = "none published";
    let row = |name, measure| Row { name, target, anchor, measure };
    vec![
        row("blackout of 15 frames", |footage, settings| measure("blackout", &BLACKOUT, footage, settings)),
        row("jerk of 25 mm", |footage, settings| measure("jerk", &JERKED, footage, settings)),
        row("cut to another view", |footage, settings| measure("cut", &CUT_AWAY, footage, settings)),
    ]
}

/// What happens, when, and what is shown meanwhile.
struct Disturbance {
    /// Frames of the recording that are fed.
    fed: Range<usize>,
    /// Those that are not what the scope would see at rest.
    disturbed: Range<usize>,
    shown: Shown,
}

enum Shown {
    AsRecorded,
    Black,
    /// The beginning of the next seed's recording.
    OtherScene,
}

const BLACKOUT: Disturbance = Disturbance { fed: 32..70, disturbed: CUT, shown: Shown::Black };
const JERKED: Disturbance = Disturbance { fed: 0..45, disturbed: JERK, shown: Shown::AsRecorded };
const CUT_AWAY: Disturbance = Disturbance { fed: 32..70, disturbed: CUT, shown: Shown::OtherScene };

fn scene(settings: &Settings, seed: u64) -> SceneConfig {
    let kind = [SceneKind::Heart, SceneKind::Liver, SceneKind::Kidney][(seed % 3) as usize];
    let jerk_frame = JERK.start as u32;
    SceneConfig { seed, frames: FRAMES, jerk_mm: JERK_MM, jerk_frame, ..rigid(settings, kind) }
}

fn open(footage: &Footage, settings: &Settings, seed: u64) -> Result<Recording, Error> {
    let path = footage.simulated(&format!("disturbed-{seed}"), &scene(settings, seed))?;
    Recording::open(&path, &settings.recording)
}

fn measure(
    name: &str,
    disturbance: &Disturbance,
    footage: &Footage,
    settings: &Settings,
) -> Result<Measured, Error> {
    let bar = progress(name, SEEDS);
    let (mut waits, mut failures) = (Vec::new(), Vec::new());
    for seed in 0..SEEDS {
        let recording = open(footage, settings, seed)?;
        let other = open(footage, settings, (seed + 1) % SEEDS)?;
        match recovery(disturbance, &recording, &other, settings)? {
            Ok(frames) => waits.push(frames),
            Err(reason) => failures.push(format!("seed {seed}: {reason}")),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let longest = waits.iter().max().map_or(String::new(), |frames| format!(", at most {frames} frames"));
    let text = format!(
        "{} of {SEEDS}{longest}{}",
        waits.len(),
        failures.iter().map(|f| format!("; {f}")).collect::<String>()
    );
    Ok(Measured::new(text, waits.len() as u64 == SEEDS))
}

/// Frames from the first usable one to the first good pose, or why there is none.
fn recovery(
    disturbance: &Disturbance,
    recording: &Recording,
    other: &Recording,
    settings: &Settings,
) -> Result<Result<usize, String>, Error> {
    let Disturbance { fed, disturbed, shown } = disturbance;
    let mut pairs = recording.pairs()?.collect::<Result<Vec<Pair>, Error>>()?;
    let others = other.pairs()?.take(disturbed.len()).collect::<Result<Vec<Pair>, Error>>()?;
    show(&mut pairs[disturbed.clone()], &others, shown);
    let stamps_ns: Vec<u64> = pairs.iter().map(|pair| pair.stamp_ns).collect();
    let truth = recording.truth(&stamps_ns)?.into_iter().collect::<Option<Vec<Pose>>>();
    let truth = truth.ok_or("a simulated frame has no true pose")?;
    let world_from_truth = truth[fed.start].inverse();
    let mut bench = Bench::new(&recording.rig, &settings.tracking)?;
    let mut keyframes_before = 0;
    for frame in fed.clone() {
        let tracked = bench.track(&pairs[frame])?;
        let estimate = tracked.report.world_from_camera;
        let error_m = estimate.map(|pose| {
            (pose.translation.vector - (world_from_truth * truth[frame]).translation.vector).norm()
        });
        if frame < disturbed.start {
            keyframes_before = bench.keyframes();
        } else if frame >= disturbed.end && error_m.is_some_and(|error_m| error_m <= POSITION_ERROR_MAX_M) {
            let map_kept = bench.keyframes() >= keyframes_before.min(2);
            return Ok(if map_kept { Ok(frame - disturbed.end) } else { Err("the map is gone".into()) });
        } else if frame >= disturbed.end + PATIENCE_FRAMES {
            return Ok(Err(match error_m {
                Some(error_m) => format!("{:.1} mm off", error_m * 1e3),
                None => "lost".into(),
            }));
        }
    }
    Ok(Err("the recording ends first".into()))
}

/// The stamps stay.
fn show(disturbed: &mut [Pair], others: &[Pair], shown: &Shown) {
    for (pair, other) in disturbed.iter_mut().zip(others) {
        match shown {
            Shown::AsRecorded => {}
            Shown::Black => {
                let (width, height) = pair.left.size();
                pair.left = Raster::filled(width, height, 2);
                pair.right = pair.left.clone();
            }
            Shown::OtherScene => {
                *pair = Pair { stamp_ns: pair.stamp_ns, ..other.clone() };
            }
        }
    }
}
