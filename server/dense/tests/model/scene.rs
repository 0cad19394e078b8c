//! A synthetic surface seen by a moving camera: a textured wall with an optional ball before it.

use std::sync::{Arc, OnceLock};

use dense::{DenseConfig, DenseError, FusionReport, Observation, SurfelModel, TrackedCamera};
use geometry::{Pinhole, Pose, StereoRig};
use gpu::{AdapterSelection, FrameRecorder, Gpu};
use nalgebra::{Point2, Point3, Vector3};

pub const WALL_M: f64 = 0.06;
const BALL: ([f64; 3], f64) = ([0.0, 0.0, 0.05], 0.006);

/// The shipped configuration, but rigid: fusion alone.
pub fn config() -> DenseConfig {
    let mut config = deforming();
    config.warp.enabled = false;
    config
}

/// The shipped configuration.
pub fn deforming() -> DenseConfig {
    let file: toml::Table = toml::from_str(include_str!("../../../../config/server.toml")).unwrap();
    file["dense"].clone().try_into().unwrap()
}

/// The same for pictures that no lamp at the camera lights.
pub fn evenly_lit() -> DenseConfig {
    let mut config = config();
    config.color.near_field = false;
    config
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

pub fn camera() -> Pinhole {
    Pinhole { width_px: 160, height_px: 120, fx_px: 140.0, fy_px: 140.0, cx_px: 79.5, cy_px: 59.5 }
}

/// What the camera looks at, and how badly it measures.
#[derive(Clone, Copy)]
pub struct Scene {
    pub ball: bool,
    /// Standard deviation of depth, metres.
    pub noise_m: f64,
}

/// Pixels as the preprocessing stage would leave them.
pub struct Shot {
    pub depth: Vec<f32>,
    pub sigma_z: Vec<f32>,
    pub normal: Vec<[f32; 4]>,
    pub color: Vec<u32>,
}

impl Scene {
    /// Distance along `direction` (z = 1 in the camera) to the surface, and its normal in world.
    fn hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let wall = (WALL_M - origin.z) / direction.z;
        let center = Point3::from(BALL.0);
        let to = origin - center;
        let (a, b) = (direction.norm_squared(), to.dot(direction));
        let inner = b * b - a * (to.norm_squared() - BALL.1 * BALL.1);
        if !self.ball || inner < 0.0 {
            return (wall, -Vector3::z());
        }
        let near = (-b - inner.sqrt()) / a;
        (near, (origin + direction * near - center).normalize())
    }

    /// The exact depth of each pixel.
    pub fn depth(&self, pose: &Pose) -> Vec<f32> {
        pixels()
            .map(|pixel| self.hit(&Point3::from(pose.translation.vector), &ray(pose, &pixel)).0 as f32)
            .collect()
    }

    /// One noisy picture; `seed` chooses the noise.
    pub fn shoot(&self, pose: &Pose, seed: u64) -> Shot {
        let origin = Point3::from(pose.translation.vector);
        let mut noise = Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let mut shot = Shot { depth: vec![], sigma_z: vec![], normal: vec![], color: vec![] };
        for pixel in pixels() {
            let direction = ray(pose, &pixel);
            let (distance, normal) = self.hit(&origin, &direction);
            let seen = pose.rotation.inverse() * normal;
            let point = origin + direction * distance;
            shot.depth.push((distance + self.noise_m * noise.gauss()) as f32);
            shot.sigma_z.push(self.noise_m.max(1e-5) as f32);
            shot.normal.push([seen.x as f32, seen.y as f32, seen.z as f32, 1.0]);
            shot.color.push(u32::from_le_bytes(texture(&point)));
        }
        shot
    }
}

/// The colour of a point of the surface; red follows x, green y.
pub fn texture(point: &Point3<f64>) -> [u8; 4] {
    let level = |metres: f64| (128.0 + 100.0 * (metres * 120.0).sin()) as u8;
    [level(point.x), level(point.y), 90, 255]
}

/// A camera at `x_m` that looks along z.
pub fn at(x_m: f64) -> Pose {
    Pose::translation(x_m, 0.0, 0.0)
}

pub struct Bench {
    pub gpu: Arc<Gpu>,
    pub observation: Observation,
    pub model: SurfelModel,
}

impl Bench {
    pub fn new(config: &DenseConfig) -> Result<Self, DenseError> {
        let gpu = gpu();
        let camera = camera();
        let rig = StereoRig { left: camera, baseline_m: 5e-3, right_cx_px: camera.cx_px };
        let observation = Observation::new(&gpu, camera.width_px, camera.height_px)?;
        let model = SurfelModel::new(gpu.clone(), rig, &observation, config)?;
        Ok(Self { gpu, observation, model })
    }

    pub fn fuse(&mut self, frame_index: u32, pose: &Pose, shot: &Shot) -> FusionReport {
        self.gpu.write(&self.observation.depth, 0, &shot.depth).unwrap();
        self.gpu.write(&self.observation.sigma_z, 0, &shot.sigma_z).unwrap();
        self.gpu.write(&self.observation.normal, 0, &shot.normal).unwrap();
        self.gpu.write(&self.observation.color, 0, &shot.color).unwrap();
        let camera = TrackedCamera { world_from_camera: *pose, at_rest: false };
        self.model.prepare(frame_index, &camera).unwrap();
        let mut frame = FrameRecorder::begin(&self.gpu, self.model.timer());
        self.model.record(&mut frame).unwrap();
        frame.submit().collect().unwrap();
        self.model.finish().unwrap()
    }
}

fn pixels() -> impl Iterator<Item = Point2<f64>> {
    let camera = camera();
    (0..camera.height_px)
        .flat_map(move |y| (0..camera.width_px).map(move |x| Point2::new(f64::from(x), f64::from(y))))
}

fn ray(pose: &Pose, pixel: &Point2<f64>) -> Vector3<f64> {
    pose.rotation * camera().back_project(pixel, 1.0).coords
}

/// A small generator of normally distributed numbers (sum of twelve uniform ones).
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn gauss(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
