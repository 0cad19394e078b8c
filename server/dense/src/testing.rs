//! What the tests of this crate share: a device, the shipped configuration, and small awkward inputs to kernels.

use std::sync::{Arc, OnceLock};

use geometry::{Pinhole, Pose, StereoRig};
use gpu::{AdapterSelection, BoundKernel, FrameRecorder, Gpu, StageTimer};
use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::fusion::FusionSettings;
use crate::model::FrameBuffers;
use crate::store::{ALIVE, STABLE, SurfelRows, SurfelStore};
use crate::tone::Tone;
use crate::{DenseConfig, Observation, View};

/// Slots and pixels of the fixtures: no multiple of any workgroup.
pub const SLOTS: usize = 345;
const WIDTH: u32 = 37;
const HEIGHT: u32 = 29;

/// Brightness of the fixtures' picture against their surfels.
pub const TONE: Tone = Tone { gain: [0.9, 1.1, 1.2, 1.0], bias: [3.0, -2.0, 1.0, 0.0] };

/// The shipped configuration.
pub fn config() -> DenseConfig {
    let file: toml::Table = toml::from_str(include_str!("../../../config/server.toml")).unwrap();
    file["dense"].clone().try_into().unwrap()
}

/// One device with poisoned buffers for all tests.
pub fn gpu() -> Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    let open = || {
        let selection = AdapterSelection { adapter: String::new() }.with_environment();
        Arc::new(Gpu::open(&selection).unwrap().with_poisoned_buffers())
    };
    GPU.get_or_init(open).clone()
}

/// Numbers in `-1..1` that look random and are the same in every run.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// Surfels about a wall 60 mm before a camera, and what that camera measures, with values among both that are no numbers.
pub struct Fixture {
    pub gpu: Arc<Gpu>,
    pub view: View,
    pub rows: SurfelRows,
    pub depth: Vec<f32>,
    pub sigma_z: Vec<f32>,
    pub normal: Vec<[f32; 4]>,
    pub color: Vec<u32>,
    pub settings: FusionSettings,
    pub buffers: FrameBuffers,
}

impl Fixture {
    pub fn new(seed: u64) -> Self {
        Self::with_index_scale(seed, 1)
    }

    pub fn with_index_scale(seed: u64, index_map_scale: u32) -> Self {
        let gpu = gpu();
        let config = DenseConfig { index_map_scale, ..config() };
        let camera = Pinhole {
            width_px: WIDTH,
            height_px: HEIGHT,
            fx_px: 40.0,
            fy_px: 41.0,
            cx_px: 17.5,
            cy_px: 14.2,
        };
        // such that the reference spread at 60 mm is about 0.3 mm
        let rig = StereoRig { left: camera, baseline_m: 0.075, right_cx_px: camera.cx_px };
        let rotation = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
        let world_from_camera = Pose::from_parts(Vector3::new(0.01, -0.02, 0.03).into(), rotation);
        let view = View { pinhole: camera, world_from_camera };
        let mut numbers = Numbers::new(seed);
        let rows = surfels(&view, &mut numbers);
        let store = SurfelStore::new(&gpu, 2048).unwrap();
        upload(&gpu, &store, &rows);
        let observation = Observation::new(&gpu, WIDTH, HEIGHT).unwrap();
        let buffers = FrameBuffers::new(&gpu, &rig, &observation, store, &config).unwrap();
        let mut settings = FusionSettings::new(&config, 40.0 * rig.baseline_m, 2048);
        (settings.slots, settings.capacity, settings.frame, settings.next_id) =
            (SLOTS as u32, 2048, 40, 9000);
        settings.seed = 77;
        let (depth, sigma_z, normal, color) = measurements(&mut numbers);
        gpu.write(&buffers.view, 0, &[view.to_gpu()]).unwrap();
        gpu.write(&buffers.settings, 0, &[settings]).unwrap();
        gpu.write(&buffers.tone, 0, &[TONE]).unwrap();
        let alive = (0..SLOTS as u32).filter(|&slot| rows.history[slot as usize][3] & ALIVE != 0);
        let alive: Vec<u32> = alive.collect();
        gpu.write(&buffers.index_map.visible.slots, 0, &[alive.len() as u32]).unwrap();
        gpu.write(&buffers.index_map.visible.slots, 1, &alive).unwrap();
        gpu.write(&observation.depth, 0, &depth).unwrap();
        gpu.write(&observation.sigma_z, 0, &sigma_z).unwrap();
        gpu.write(&observation.normal, 0, &normal).unwrap();
        gpu.write(&observation.color, 0, &color).unwrap();
        Self { gpu, view, rows, depth, sigma_z, normal, color, settings, buffers }
    }

    /// Runs one kernel over `invocations`, after zeroing what `clear` names.
    pub fn run(&self, kernel: &BoundKernel, invocations: usize, clear: impl FnOnce(&mut FrameRecorder)) {
        let timer = StageTimer::new(&self.gpu, 1).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, &timer);
        clear(&mut frame);
        frame.stage("kernel", |stage| stage.run(kernel, [invocations as u32, 1, 1])).unwrap();
        frame.submit().collect().unwrap();
    }

    pub fn pixels(&self) -> usize {
        self.depth.len()
    }

    /// The surfels as they are now.
    pub fn read(&self) -> SurfelRows {
        self.buffers.store.read(&self.gpu, self.settings.slots).unwrap()
    }

    /// Writes the result block's first places.
    pub fn write_results(&self, first: &[u32]) {
        self.gpu.write(&self.buffers.results, 0, &vec![0u32; self.buffers.results.len()]).unwrap();
        self.gpu.write(&self.buffers.results, 0, first).unwrap();
    }
}

pub fn upload(gpu: &Gpu, store: &SurfelStore, rows: &SurfelRows) {
    gpu.write(&store.geometry, 0, &rows.geometry).unwrap();
    gpu.write(&store.orientation, 0, &rows.orientation).unwrap();
    gpu.write(&store.appearance, 0, &rows.appearance).unwrap();
    gpu.write(&store.history, 0, &rows.history).unwrap();
}

/// A point in the camera's frame, as a point of the fixture's world.
pub fn in_world(view: &View, point: Vector3<f64>) -> Vector3<f64> {
    (view.world_from_camera * Point3::from(point)).coords
}

fn surfels(view: &View, numbers: &mut Numbers) -> SurfelRows {
    let mut rows = SurfelRows::default();
    for slot in 0..SLOTS {
        let around = numbers.vector();
        let before_m = if slot % 7 == 0 { 0.006 } else { 0.0 };
        let center = Vector3::new(0.03 * around.x, 0.025 * around.y, 0.06 - before_m + 0.003 * around.z);
        let point = in_world(view, center);
        let tilted = (-Vector3::z() + 0.4 * numbers.vector()).normalize();
        let normal = view.world_from_camera * tilted;
        let mut geometry = [point.x, point.y, point.z, 0.0008].map(|value| value as f32);
        if slot % 17 == 16 {
            geometry[slot % 4] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][slot % 3];
        }
        let weight = 10.0 + 9.9 * numbers.next();
        rows.geometry.push(geometry);
        rows.orientation.push([normal.x, normal.y, normal.z, weight].map(|value| value as f32));
        rows.appearance.push([100.0, 150.0, 200.0, 3.0].map(|value: f32| value + numbers.next() as f32));
        let state = [ALIVE | STABLE, ALIVE, 0][usize::from(slot % 5 == 3) + usize::from(slot % 11 == 10)];
        let seen = 40 - (slot as u32 * 7 % 25);
        rows.history.push([10 * slot as u32, seen, 1, state]);
    }
    rows
}

type Measurements = (Vec<f32>, Vec<f32>, Vec<[f32; 4]>, Vec<u32>);

fn measurements(numbers: &mut Numbers) -> Measurements {
    let (mut depth, mut sigma_z, mut normal, mut color) = (vec![], vec![], vec![], vec![]);
    for pixel in 0..(WIDTH * HEIGHT) as usize {
        let strange = [f32::NAN, f32::INFINITY, 0.0, -1.0][pixel % 4];
        depth.push(if pixel % 13 == 12 { strange } else { (0.06 + 0.002 * numbers.next()) as f32 });
        sigma_z.push(if pixel % 29 == 28 { strange } else { (0.0003 + 0.0002 * numbers.next()) as f32 });
        let facing = (-Vector3::z() + 0.4 * numbers.vector()).normalize();
        let valid = if pixel % 23 == 22 { 0.0 } else { 1.0 };
        normal.push([facing.x as f32, facing.y as f32, facing.z as f32, valid]);
        let alpha = if pixel % 7 == 6 { 0 } else { 255 };
        color.push(u32::from_le_bytes([pixel as u8, 77, 200, alpha]));
    }
    (depth, sigma_z, normal, color)
}
