//! Plans the deformation of a run: breathing or beat, and pushes of tissue that is in view.

use geometry::Pinhole;
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::camera_path::CameraPath;
use crate::deformation::{Deformation, Push};
use crate::picture::{VisibilityBuffer, thumbnail_camera};
use crate::scene::{Scene, Vertex};
use crate::{SceneConfig, SceneKind};

/// Pushes start this long after the first frame.
const FIRST_PUSH_S: f64 = 1.0 / 6.0;
/// A push hits inside this share of the picture, around its middle.
const PUSHED_SHARE: f64 = 0.76;
const TRIES: usize = 60;
/// Half wavelength of the phantom's beat over its surface.
const BEAT_LENGTH_MM: f64 = 48.0;

/// The motion that a configuration asks for.
pub(crate) fn plan(config: &SceneConfig, scene: &Scene, path: &CameraPath) -> Deformation {
    let mut random = Pcg64::seed_from_u64(config.seed ^ 0x00de_f000);
    let mut jitter = |value: f64| value + random.random_range(-0.2..0.2);
    let direction = Vector3::new(jitter(0.55), jitter(-0.35), jitter(-0.6)).normalize();
    match config.scene {
        SceneKind::Phantom => beating(config, scene, direction),
        SceneKind::Heart | SceneKind::Liver | SceneKind::Kidney | SceneKind::Abdomen => {
            let mut deformation = breathing(config, scene, direction);
            if config.deformation_mm > 0.0 {
                add_pushes(&mut deformation, config, scene, path, &mut random);
            }
            deformation
        }
    }
}

fn breathing(config: &SceneConfig, scene: &Scene, direction: Vector3<f64>) -> Deformation {
    let gain = |vertex: &Vertex| scene.breathing[usize::from(vertex.organ)] as f32;
    let gains = scene.vertices.iter().map(gain).collect();
    Deformation::periodic(gains, direction * (config.respiration_mm * 1e-3), config.respiration_hz)
}

/// Parts of the heart move more than others, none opposite: the whole contracts towards one side.
fn beating(config: &SceneConfig, scene: &Scene, direction: Vector3<f64>) -> Deformation {
    let gain = |vertex: &Vertex| {
        let at = vertex.position_m * (1e3 / BEAT_LENGTH_MM);
        let wave = 0.5 + 0.5 * (2.1 * at.x + 0.6).cos() * (1.7 * at.y - 0.4).cos();
        (scene.breathing[usize::from(vertex.organ)] * wave) as f32
    };
    let gains = scene.vertices.iter().map(gain).collect();
    Deformation::periodic(gains, direction * (config.deformation_mm * 1e-3), config.beat_hz)
}

fn add_pushes(
    deformation: &mut Deformation,
    config: &SceneConfig,
    scene: &Scene,
    path: &CameraPath,
    random: &mut Pcg64,
) {
    let end_s = config.time_s(config.frames);
    let mut start_s = FIRST_PUSH_S;
    while start_s < end_s {
        let positions = deformation.at(&scene.vertices, start_s);
        let camera = thumbnail_camera(&config.rig().left);
        let camera_from_world = path.world_from_camera(start_s).inverse();
        let view = VisibilityBuffer::new(&positions, &scene.faces, &camera_from_world, &camera);
        if let Some(vertex) = vertex_in_view(scene, &view, &camera, random) {
            let push = push_of(vertex, start_s, &positions, (config, scene, deformation), random);
            deformation.push(&scene.vertices, push);
        }
        start_s += config.push_interval_s;
    }
}

/// A random vertex of an organ near the middle of the picture; none where only the wall is there.
fn vertex_in_view(
    scene: &Scene,
    view: &VisibilityBuffer,
    camera: &Pinhole,
    random: &mut Pcg64,
) -> Option<u32> {
    (0..TRIES).find_map(|_| {
        let mut inside = |size: u32| {
            let share = 0.5 + PUSHED_SHARE * random.random_range(-0.5..0.5);
            (share * f64::from(size)) as u32
        };
        let face = view.face_at(inside(camera.width_px), inside(camera.height_px))?;
        let vertex = scene.faces[face as usize][0];
        ((vertex as usize) < scene.organ_vertices).then_some(vertex)
    })
}

/// In or out along the normal and a little to the side; back, where the tissue was already pushed far.
fn push_of(
    vertex: u32,
    start_s: f64,
    positions: &[Point3<f64>],
    (config, scene, deformation): (&SceneConfig, &Scene, &Deformation),
    random: &mut Pcg64,
) -> Push {
    let normal: Vector3<f64> = scene.vertex_normals(positions)[vertex as usize].cast();
    let size_m = 1e-3 * config.deformation_mm * random.random_range(2.0 / 3.0..=1.0);
    let pushed_m = deformation.pushed_m(vertex, f64::INFINITY).dot(&normal);
    let outward = match pushed_m / size_m {
        far if far > 0.5 => -1.0,
        far if far < -0.5 => 1.0,
        _ if random.random_bool(0.5) => 1.0,
        _ => -1.0,
    };
    let sideways = Vector3::from_fn(|_, _| random.random_range(-0.5..0.5));
    let radius_mm = random.random_range(config.push_radius_min_mm..=config.push_radius_max_mm);
    Push {
        centre_m: scene.vertices[vertex as usize].position_m,
        displacement_m: (normal * outward + sideways).normalize() * size_m,
        radius_m: radius_mm * 1e-3,
        start_s,
        duration_s: config.push_duration_s,
    }
}
