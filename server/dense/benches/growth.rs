//! How the time of a frame grows with the part of the model that is out of view:
//! `cargo bench -p dense --bench growth [SMALL] [LARGE]`, 100,000 and 2,000,000 surfels by default.
//!
//! A camera of 640x480 passes over fresh wall until the model is large enough, then rests before a part of it. Prints the
//! medians of each stage with the small and with the large model, and their ratio.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and fails where it cannot go on"
)]

use std::collections::BTreeMap;
use std::sync::Arc;

use dense::{DenseConfig, Observation, SurfelModel, TrackedCamera};
use geometry::{Pinhole, Pose, StereoRig};
use gpu::{AdapterSelection, FrameRecorder, Gpu};

/// Frames that are timed.
const FRAMES: u32 = 15;
/// Frames in which new surfels become stable.
const SETTLING: u32 = 3;
/// The camera's step to wall that it has not seen, metres.
const STEP_M: f64 = 0.07;

struct Bench {
    gpu: Arc<Gpu>,
    model: SurfelModel,
    frame: u32,
}

impl Bench {
    fn new(config: &DenseConfig) -> Self {
        let selection = AdapterSelection { adapter: String::new() }.with_environment();
        let gpu = Arc::new(Gpu::open(&selection).unwrap());
        let left =
            Pinhole { width_px: 640, height_px: 480, fx_px: 520.0, fy_px: 520.0, cx_px: 319.5, cy_px: 239.5 };
        let rig = StereoRig { left, baseline_m: 5e-3, right_cx_px: left.cx_px };
        let observation = Observation::new(&gpu, 640, 480).unwrap();
        let pixels = 640 * 480;
        gpu.write(&observation.depth, 0, &vec![0.06f32; pixels]).unwrap();
        gpu.write(&observation.sigma_z, 0, &vec![2e-4f32; pixels]).unwrap();
        gpu.write(&observation.normal, 0, &vec![[0.0f32, 0.0, -1.0, 1.0]; pixels]).unwrap();
        gpu.write(&observation.color, 0, &vec![0xff80_6040u32; pixels]).unwrap();
        let model = SurfelModel::new(gpu.clone(), rig, &observation, config).unwrap();
        Self { gpu, model, frame: 0 }
    }

    /// Fuses a frame before one place of the wall; the time of each stage.
    fn fuse(&mut self, place: u32) -> BTreeMap<&'static str, f64> {
        let world_from_camera =
            Pose::translation(STEP_M * f64::from(place % 64), STEP_M * f64::from(place / 64), 0.0);
        self.model.prepare(self.frame, &TrackedCamera { world_from_camera, at_rest: false }).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, self.model.timer());
        self.model.record(&mut frame).unwrap();
        let times = frame.submit().collect().unwrap();
        self.model.finish().unwrap();
        self.frame += 1;
        times.stages.iter().map(|stage| (stage.name, stage.ms)).collect()
    }

    /// Looks at new places until the model has `surfels`; then times frames before the first place.
    fn medians_at(&mut self, place: &mut u32, surfels: u32) -> BTreeMap<&'static str, f64> {
        while self.model.surfel_counts().1 < surfels {
            for _ in 0..SETTLING {
                self.fuse(*place);
            }
            *place += 1;
        }
        let mut times: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for _ in 0..FRAMES {
            for (name, ms) in self.fuse(0) {
                times.entry(name).or_default().push(ms);
            }
        }
        let median = |mut ms: Vec<f64>| {
            ms.sort_by(f64::total_cmp);
            ms[ms.len() / 2]
        };
        times.into_iter().map(|(name, ms)| (name, median(ms))).collect()
    }
}

fn main() {
    let file: toml::Table = toml::from_str(include_str!("../../../config/server.toml")).unwrap();
    let config: DenseConfig = file["dense"].clone().try_into().unwrap();
    let mut sizes = std::env::args().filter_map(|argument| argument.parse().ok());
    let (small, large) = (sizes.next().unwrap_or(100_000), sizes.next().unwrap_or(2_000_000));
    let (mut bench, mut place) = (Bench::new(&config), 0);
    let few = bench.medians_at(&mut place, small);
    let counts = bench.model.surfel_counts();
    let many = bench.medians_at(&mut place, large);
    println!(
        "{}: {} surfels, then {}",
        bench.gpu.description().name,
        counts.1,
        bench.model.surfel_counts().1
    );
    for (name, before) in &few {
        println!("{name:>12} {before:8.2} ms {:8.2} ms", many[name]);
    }
    let sum = |times: &BTreeMap<&str, f64>| times.values().sum::<f64>();
    let (before, after) = (sum(&few), sum(&many));
    println!(
        "{:>12} {before:8.2} ms {after:8.2} ms, {:+.1} % of this part of a frame",
        "all",
        100.0 * (after / before - 1.0)
    );
    let bytes = bench.gpu.memory_use().current_bytes as f64;
    println!("GPU memory {:.0} MiB", bytes / f64::from(1 << 20));
}
