//! A run: frames with everything that is true about them.

use geometry::{DepthMap, Pose, Rgb, StereoRig};
use nalgebra::{Point3, Translation3, Vector3};
use rayon::prelude::*;

use crate::camera_path::CameraPath;
use crate::deformation::Deformation;
use crate::material_points::{self, MaterialPoint};
use crate::picture::{ScopeLight, Sensor, Shot, VisibilityBuffer, exposure_gain, shade, thumbnail_camera};
use crate::scene::Scene;
use crate::{SceneConfig, SimulatorError, TruthMesh, motion};

/// Stamp of the first frame of every run: a fixed day, so that runs are reproducible.
const FIRST_STAMP_NS: u64 = 1_760_000_000_000_000_000;
/// Frames looked at when material points are chosen.
const POINT_VIEWS: u32 = 12;
/// A vertex is seen if nothing lies this much before it on a thumbnail.
const SEEN_TOLERANCE_M: f64 = 1.2e-3;

/// A scene in motion, seen by a moving scope.
pub struct Simulation {
    config: SceneConfig,
    rig: StereoRig,
    scene: Scene,
    path: CameraPath,
    deformation: Deformation,
    sensor: Sensor,
    points: Vec<MaterialPoint>,
}

/// One stereo pair and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedFrame {
    /// Middle of the exposure.
    pub stamp_ns: u64,
    /// Left picture.
    pub left: Rgb,
    /// Right picture.
    pub right: Rgb,
    /// Pose of the left camera in the world, which is the left camera of frame 0.
    pub world_from_camera: Pose,
    /// Of the left view.
    pub depth: DepthMap,
    /// Material points by id: where they are in the world, metres.
    pub points: Vec<(u32, [f64; 3])>,
}

impl Simulation {
    /// Builds the scene, plans all motion and chooses the material points.
    ///
    /// # Errors
    /// [`SimulatorError::OutOfRange`] for a value that cannot be simulated, [`SimulatorError::NothingInView`].
    pub fn new(config: &SceneConfig) -> Result<Self, SimulatorError> {
        config.check()?;
        let scene = Scene::of_kind(config.scene, config.seed, coarseness(config.width_px));
        let path = CameraPath::new(config, scene.pivot_mm);
        let deformation = motion::plan(config, &scene, &path);
        let mut simulation = Self {
            config: config.clone(),
            rig: config.rig(),
            scene,
            path,
            deformation,
            sensor: Sensor::new(config),
            points: Vec::new(),
        };
        let stride = config.frames.div_ceil(POINT_VIEWS).max(1) as usize;
        let seen = simulation.seen_frames((0..config.frames).step_by(stride));
        simulation.points = material_points::spread(config, &simulation.scene, &seen)?;
        Ok(simulation)
    }

    /// The rectified rig of both eyes.
    pub fn rig(&self) -> &StereoRig {
        &self.rig
    }

    /// Frames of the run.
    pub fn frames(&self) -> u32 {
        self.config.frames
    }

    /// The stamp of a frame.
    pub fn stamp_ns(&self, frame: u32) -> u64 {
        FIRST_STAMP_NS + (self.config.time_s(frame) * 1e9).round() as u64
    }

    /// The pose of the left camera at a frame.
    pub fn world_from_camera(&self, frame: u32) -> Pose {
        self.path.world_from_camera(self.config.time_s(frame))
    }

    /// Renders a frame. Frames are independent of each other and of the number of threads.
    ///
    /// # Errors
    /// [`SimulatorError::NoSuchFrame`] past the end of the run.
    pub fn frame(&self, frame: u32) -> Result<SimulatedFrame, SimulatorError> {
        if frame >= self.config.frames {
            return Err(SimulatorError::NoSuchFrame { frame, frames: self.config.frames });
        }
        let positions = self.positions(frame);
        let normals = self.scene.vertex_normals(&positions);
        let (left_light, depth) = self.eye(frame, &positions, &normals, 0.0);
        let (right_light, _) = self.eye(frame, &positions, &normals, self.rig.baseline_m);
        let gain = exposure_gain(&left_light);
        // keys of the noise lie further apart than a picture has pixels
        let key = |eye: u64| self.config.seed.wrapping_add((u64::from(frame) * 2 + eye) << 32);
        Ok(SimulatedFrame {
            stamp_ns: self.stamp_ns(frame),
            left: self.sensor.expose(&left_light, gain, key(0)),
            right: self.sensor.expose(&right_light, gain, key(1)),
            world_from_camera: self.world_from_camera(frame),
            depth,
            points: self.points_at(&positions),
        })
    }

    /// The true surface and its motion. Looks at every frame of the run, so it takes a few per cent of rendering it.
    pub fn truth_mesh(&self) -> TruthMesh {
        let frames = 0..self.config.frames;
        TruthMesh {
            rest_m: self.scene.vertices.iter().map(|vertex| vertex.position_m).collect(),
            faces: self.scene.faces.clone(),
            seen_frames: self.seen_frames(frames.clone()),
            organ_vertices: self.scene.organ_vertices,
            times_s: frames.clone().map(|frame| self.config.time_s(frame)).collect(),
            stamps_ns: frames.map(|frame| self.stamp_ns(frame)).collect(),
            breathing_gain: self.deformation.gain.clone(),
            breathing_m: self.deformation.swing_m,
            breathing_hz: self.deformation.swing_hz,
            pushes: self.deformation.pushes.clone(),
        }
    }

    fn positions(&self, frame: u32) -> Vec<Point3<f64>> {
        self.deformation.at(&self.scene.vertices, self.config.time_s(frame))
    }

    fn points_at(&self, positions: &[Point3<f64>]) -> Vec<(u32, [f64; 3])> {
        let place = |point: &MaterialPoint| point.at(&self.scene.faces, positions).into();
        self.points.iter().enumerate().map(|(id, point)| (id as u32, place(point))).collect()
    }

    /// Light and depth of the eye that lies `aside_m` to the right of the left one.
    fn eye(
        &self,
        frame: u32,
        positions: &[Point3<f64>],
        normals: &[Vector3<f32>],
        aside_m: f64,
    ) -> (crate::picture::Radiance, DepthMap) {
        let time_s = self.config.time_s(frame);
        let eye_from_world = |time_s: f64| {
            Translation3::new(-aside_m, 0.0, 0.0) * self.path.world_from_camera(time_s).inverse()
        };
        let half_open_s = 0.5e-3 * self.config.exposure_ms;
        let world_from_left = self.path.world_from_camera(time_s);
        shade(&Shot {
            scene: &self.scene,
            positions,
            normals,
            camera: &self.rig.left,
            camera_from_world: eye_from_world(time_s),
            shutter: [eye_from_world(time_s - half_open_s), eye_from_world(time_s + half_open_s)],
            light: &ScopeLight::new(&world_from_left, self.rig.baseline_m, self.config.highlights),
        })
    }

    /// How many of the frames show each vertex to the left eye.
    fn seen_frames(&self, frames: impl Iterator<Item = u32>) -> Vec<u16> {
        let camera = thumbnail_camera(&self.rig.left);
        let mut seen = vec![0_u16; self.scene.vertices.len()];
        for frame in frames {
            let positions = self.positions(frame);
            let camera_from_world = self.world_from_camera(frame).inverse();
            let view = VisibilityBuffer::new(&positions, &self.scene.faces, &camera_from_world, &camera);
            seen.par_iter_mut().enumerate().for_each(|(vertex, count)| {
                *count = count.saturating_add(u16::from(view.shows(vertex, SEEN_TOLERANCE_M)));
            });
        }
        seen
    }
}

/// Edge length of the triangles against those for a picture of 640 columns; at most doubled, to keep the shapes.
fn coarseness(width_px: u32) -> f64 {
    (640.0 / f64::from(width_px)).clamp(1.0, 2.0)
}
