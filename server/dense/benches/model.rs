//! Time per stage of the surfel model at 640x480: `cargo bench -p dense --bench model [FRAMES]`.
//!
//! A camera sways before a wavy wall 60 mm away. Prints the median of each stage on the GPU's clock, the number of
//! dispatches, surfels and bytes.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and fails where it cannot go on"
)]

use std::collections::BTreeMap;
use std::sync::Arc;

use dense::{Coloring, DenseConfig, EncodingSteps, Observation, SurfelModel, TrackedCamera, View};
use geometry::{Pinhole, Pose, StereoRig};
use gpu::{AdapterSelection, FrameRecorder, Gpu};

const FRAMES: u32 = 30;
const STEPS: EncodingSteps =
    EncodingSteps { position_m: 2e-5, position_max_m: 20.0, node_m: 4e-6, affine: 1.0 / 4096.0 };

fn rig() -> StereoRig {
    let left =
        Pinhole { width_px: 640, height_px: 480, fx_px: 520.0, fy_px: 520.0, cx_px: 319.5, cy_px: 239.5 };
    StereoRig { left, baseline_m: 5e-3, right_cx_px: left.cx_px }
}

/// Depth of the wavy wall along a pixel's ray, by fixed-point iteration.
fn depth_m(rig: &StereoRig, x: u32, y: u32, camera_x_m: f64) -> f64 {
    let pixel = nalgebra::Point2::new(f64::from(x), f64::from(y));
    let ray = rig.left.back_project(&pixel, 1.0);
    (0..4).fold(0.06, |depth, _| {
        let (u, v) = ((camera_x_m + ray.x * depth) * 300.0, ray.y * depth * 300.0);
        0.06 + 1.5e-3 * u.sin() * v.cos()
    })
}

fn upload(gpu: &Gpu, observation: &Observation, rig: &StereoRig, camera_x_m: f64) {
    let coordinates = (0..480u32).flat_map(|y| (0..640u32).map(move |x| (x, y)));
    let depth: Vec<f32> = coordinates.map(|(x, y)| depth_m(rig, x, y, camera_x_m) as f32).collect();
    let pixels = depth.len();
    gpu.write(&observation.depth, 0, &depth).unwrap();
    gpu.write(&observation.sigma_z, 0, &vec![2e-4; pixels]).unwrap();
    gpu.write(&observation.normal, 0, &vec![[0.0, 0.0, -1.0, 1.0]; pixels]).unwrap();
    gpu.write(&observation.color, 0, &vec![0xff80_6040; pixels]).unwrap();
}

fn main() {
    let file: toml::Table = toml::from_str(include_str!("../../../config/server.toml")).unwrap();
    let config: DenseConfig = file["dense"].clone().try_into().unwrap();
    let gpu = Arc::new(Gpu::open(&AdapterSelection { adapter: String::new() }.with_environment()).unwrap());
    let rig = rig();
    let observation = Observation::new(&gpu, 640, 480).unwrap();
    let mut model = SurfelModel::new(gpu.clone(), rig, &observation, &config).unwrap();
    let frames = std::env::args().filter_map(|argument| argument.parse().ok()).next().unwrap_or(FRAMES);
    let mut times: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    let mut dispatches = 0;
    for index in 0..frames {
        let camera_x_m = 0.02 * (f64::from(index) * 0.2).sin();
        upload(&gpu, &observation, &rig, camera_x_m);
        let world_from_camera = Pose::translation(camera_x_m, 0.0, 0.0);
        model.prepare(index, &TrackedCamera { world_from_camera, at_rest: false }).unwrap();
        let mut frame = FrameRecorder::begin(&gpu, model.timer());
        model.record(&mut frame).unwrap();
        let frame_times = frame.submit().collect().unwrap();
        model.finish().unwrap();
        dispatches = frame_times.dispatches;
        let changes = model.take_changes(&STEPS).unwrap();
        for stage in frame_times.stages.iter().chain(&changes.stages) {
            times.entry(stage.name).or_default().push(stage.ms);
        }
    }
    model
        .render(&View { pinhole: rig.left, world_from_camera: Pose::identity() }, Coloring::Colour, [0; 3])
        .unwrap();
    report(&gpu, &model, &mut times, dispatches);
}

fn report(gpu: &Gpu, model: &SurfelModel, times: &mut BTreeMap<&str, Vec<f64>>, dispatches: u32) {
    let (alive, stable) = model.surfel_counts();
    println!("{}: {alive} surfels, {stable} stable, {dispatches} dispatches", gpu.description().name);
    for (name, stage) in times {
        stage.sort_by(f64::total_cmp);
        println!("{name:>12} {:8.2} ms", stage[stage.len() / 2]);
    }
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    println!(
        "GPU memory {:.0} MiB, at most {:.0}",
        mib(gpu.memory_use().current_bytes),
        mib(gpu.memory_use().peak_bytes)
    );
}
