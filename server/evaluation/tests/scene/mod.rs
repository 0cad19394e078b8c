//! A small recording with truth, and results that miss it by closed-form errors.

use std::io::Cursor;
use std::path::Path;

use geometry::trajectory::StampedPose;
use geometry::{DepthMap, Gray, Pinhole, Pose, StereoRig};
use nalgebra::{Point2, Point3, Vector3};
use npyz::npz::NpzWriter;
use npyz::zip::write::FileOptions;
use npyz::{AutoSerialize, WriterBuilder};
use recording::export::{PlySurfel, TrackedPoint, write_pfm, write_ply, write_points, write_tum};
use recording::{
    Calibration, RecordingConfig, RecordingReader, RecordingWriter, TruthPoints, encode_png_gray,
};

const FRAMES: u32 = 12;
const LOST_FRAME: u32 = 4;
const FRAME_GAP_NS: u64 = 33_333_333;
const FIRST_NS: u64 = 1_700_000_000_000_000_000;
const DEPTH_FRAMES: [u32; 3] = [0, 5, FRAMES - 1];
/// Side of the grid of vertices, 5 mm apart.
const GRID: u32 = 21;
const POINTS: u32 = 60;
const CAMERA: Pinhole =
    Pinhole { width_px: 64, height_px: 48, fx_px: 52.0, fy_px: 52.0, cx_px: 31.5, cy_px: 23.5 };

#[derive(serde::Deserialize)]
struct Config {
    recording: RecordingConfig,
}

fn config() -> RecordingConfig {
    let text = include_str!("../../../../config/server.toml");
    toml::from_str::<Config>(text).expect("the shipped configuration").recording
}

pub fn open(path: &Path) -> RecordingReader {
    RecordingReader::open(path, &config()).expect("a recording")
}

fn stamp_ns(frame: u32) -> u64 {
    FIRST_NS + u64::from(frame) * FRAME_GAP_NS
}

fn pose(turn: [f64; 3], place_m: [f64; 3]) -> Pose {
    Pose::new(Vector3::from(place_m), Vector3::from(turn))
}

/// In the world of the recording, which is not that of the first camera.
fn recorded_from_camera(frame: u32) -> Pose {
    let i = f64::from(frame);
    pose([0.02 + 0.004 * i, -0.01 * (0.4 * i).sin(), 0.03], [0.001 * i, 0.002 * (0.5 * i).sin(), -0.004])
}

fn world_from_recorded() -> Pose {
    recorded_from_camera(0).inverse()
}

fn estimated_world_from_camera(frame: u32) -> Pose {
    let i = f64::from(frame);
    let error = pose(
        [0.001 * (3.0 * i).sin(), 0.0005 * i.cos(), 0.0003 * i],
        [2e-4 * (2.0 * i).cos(), 1e-4 * i.sin(), 4e-5 * i],
    );
    world_from_recorded() * recorded_from_camera(frame) * error
}

fn surface(x: f64, y: f64) -> Point3<f64> {
    Point3::new(x, y, 0.1 + 0.004 * (60.0 * x).sin() * (50.0 * y).cos())
}

fn vertex(index: u32) -> Point3<f64> {
    surface(f64::from(index % GRID) * 0.005 - 0.05, f64::from(index / GRID) * 0.005 - 0.05)
}

/// With pixels without depth, and a step that tears the surface.
fn depth(frame: u32) -> DepthMap {
    DepthMap::from_fn(CAMERA.width_px, CAMERA.height_px, |x, y| {
        let (x, y, i) = (f64::from(x), f64::from(y), f64::from(frame));
        let smooth = 0.09 + 0.006 * (x / 9.0 + 0.1 * i).sin() + 0.004 * (y / 7.0).cos();
        if (x * 7.0 + y * 3.0) % 23.0 < 1.0 {
            0.0
        } else if x > 50.0 {
            (smooth + 0.03) as f32
        } else {
            smooth as f32
        }
    })
}

fn estimated_depth(frame: u32) -> DepthMap {
    let truth = depth(frame);
    DepthMap::from_fn(CAMERA.width_px, CAMERA.height_px, |x, y| {
        let wave = f64::from(x * 13 + y * 29 + frame);
        match (x + 2 * y) % 11 {
            0 => 0.0,
            1 => f32::INFINITY,
            _ => truth[(x, y)] + (0.004 * wave.sin().powi(3)) as f32,
        }
    })
}

/// A material point in the world of the recording.
fn truth_point(id: u32, frame: u32) -> Point3<f64> {
    let (start, i) = (vertex(id * 7), f64::from(frame));
    let push = (-400.0 * (start.x * start.x + start.y * start.y)).exp();
    start + Vector3::new(0.0, 3e-4 * i * push, -2e-4 * i * push + 1e-4 * i)
}

fn truth_points(frame: u32) -> TruthPoints {
    let points_in_world = (0..POINTS).map(|id| truth_point(id, frame)).collect();
    TruthPoints { stamp_ns: stamp_ns(frame), ids: (0..POINTS).collect(), points_in_world }
}

/// Writes the recording, with or without the true mesh.
pub fn write_recording(path: &Path, with_mesh: bool) {
    let mut writer = RecordingWriter::create(path, &config()).expect("a writable folder");
    let rig = StereoRig { left: CAMERA, baseline_m: 0.005, right_cx_px: CAMERA.cx_px };
    writer.write_calibration(FIRST_NS, &Calibration::Rectified(rig)).expect("a rig");
    let image = encode_png_gray(&Gray::filled(CAMERA.width_px, CAMERA.height_px, 90)).expect("an image");
    for frame in 0..FRAMES {
        let stamp_ns = stamp_ns(frame);
        writer.write_pair(stamp_ns, &image, &image).expect("a pair");
        let world_from_camera = recorded_from_camera(frame);
        writer.write_truth_pose(&StampedPose { stamp_ns, world_from_camera }).expect("a pose");
        writer.write_truth_points(&truth_points(frame)).expect("points");
        if DEPTH_FRAMES.contains(&frame) {
            writer.write_truth_depth(stamp_ns, &depth(frame)).expect("a depth map");
        }
    }
    if with_mesh {
        let archive = mesh_archive();
        writer
            .attach(FIRST_NS, "truth_mesh.npz", "application/octet-stream", &archive)
            .expect("an attachment");
    }
    writer.finish().expect("a writable folder");
}

/// The grid, breathing and pushed twice, in the archive that the simulator attaches.
pub fn mesh_archive() -> Vec<u8> {
    let mut archive = NpzWriter::new(Cursor::new(Vec::new()));
    let vertices: Vec<Point3<f64>> = (0..GRID * GRID).map(vertex).collect();
    let count = u64::from(GRID * GRID);
    let coordinates = vertices.iter().flat_map(|v| [v.x as f32, v.y as f32, v.z as f32]);
    add(&mut archive, "v0", &[count, 3], coordinates);
    let faces: Vec<i32> = (0..GRID - 1)
        .flat_map(|y| (0..GRID - 1).map(move |x| (y * GRID + x) as i32))
        .flat_map(|i| [i, i + 1, i + GRID as i32, i + 1, i + GRID as i32 + 1, i + GRID as i32])
        .collect();
    add(&mut archive, "faces", &[faces.len() as u64 / 3, 3], faces);
    let seen = vertices.iter().map(|v| if v.x < 0.031 { 5u16 } else { 2 });
    add(&mut archive, "seen_frames", &[count], seen);
    add(&mut archive, "n_organ", &[], [i64::from(GRID * GRID)]);
    let stamps = (0..FRAMES).map(|frame| stamp_ns(frame) as i64);
    add(&mut archive, "stamps", &[FRAMES.into()], stamps);
    let times = (0..FRAMES).map(|frame| (u64::from(frame) * FRAME_GAP_NS) as f64 * 1e-9);
    add(&mut archive, "times", &[FRAMES.into()], times);
    add(&mut archive, "resp_gain", &[count], vertices.iter().map(|v| (0.5 + v.y) as f32));
    add(&mut archive, "resp_vec", &[3], [0.0, 0.001, -0.002]);
    add(&mut archive, "resp_hz", &[], [0.9]);
    add(&mut archive, "push_centre", &[2, 3], [0.01, 0.0, 0.1, -0.02, 0.02, 0.1]);
    add(&mut archive, "push_vec", &[2, 3], [0.0, 0.001, 0.003, 0.002, 0.0, -0.002]);
    add(&mut archive, "push_radius", &[2], [0.02, 0.03]);
    add(&mut archive, "push_start", &[2], [0.05, 0.2]);
    add(&mut archive, "push_dur", &[2], [0.1, 0.4]);
    archive.zip_writer().finish().expect("in memory").into_inner()
}

fn add<T: AutoSerialize>(
    archive: &mut NpzWriter<Cursor<Vec<u8>>>,
    name: &str,
    shape: &[u64],
    values: impl IntoIterator<Item = T>,
) {
    let array = archive.array(name, FileOptions::default()).expect("in memory");
    let mut array = array.default_dtype().shape(shape).begin_nd().expect("in memory");
    array.extend(values).expect("in memory");
    array.finish().expect("in memory");
}

/// Writes what a replay that errs would have written; depth files are numbered from one.
pub fn write_results(folder: &Path) {
    let poses: Vec<_> = (0..FRAMES)
        .filter(|&frame| frame != LOST_FRAME)
        .map(|frame| StampedPose {
            stamp_ns: stamp_ns(frame),
            world_from_camera: estimated_world_from_camera(frame),
        })
        .collect();
    write_tum(&folder.join("trajectory.tum"), &poses).expect("a writable folder");
    std::fs::create_dir_all(folder.join("depth")).expect("a writable folder");
    for frame in DEPTH_FRAMES {
        let file = folder.join(format!("depth/{:06}.pfm", frame + 1));
        write_pfm(&file, &estimated_depth(frame)).expect("a writable folder");
    }
    write_ply(&folder.join("model.ply"), &model()).expect("a writable folder");
    write_points(&folder.join("points.csv"), &tracked_points()).expect("a writable folder");
}

/// Points near the mesh, near the last depth map, hidden behind it, far away, and not finite.
fn model() -> Vec<PlySurfel> {
    let near_mesh = (0..1500).map(|i| {
        let i = f64::from(i);
        let on_surface = surface(0.04 * (i * 0.7).sin() - 0.01, 0.045 * (i * 1.1).cos());
        world_from_recorded() * (on_surface + Vector3::new(0.0, 0.0, 1.5e-3 * (i * 2.3).sin()))
    });
    let last = depth(FRAMES - 1);
    let world_from_last = world_from_recorded() * recorded_from_camera(FRAMES - 1);
    let near_depth = (0..1500).map(|i| {
        let (x, y) = ((i * 17) % CAMERA.width_px, (i * 31) % CAMERA.height_px);
        let error_m = if i % 40 == 0 { 0.03 } else { 2e-3 * (f64::from(i) * 1.7).sin() };
        let pixel = Point2::new(f64::from(x), f64::from(y));
        world_from_last * CAMERA.back_project(&pixel, f64::from(last[(x, y)]) + error_m)
    });
    let odd = [Point3::new(0.5, 0.5, 0.5), Point3::new(f64::NAN, 0.0, 0.1)];
    let surfel = |point: Point3<f64>| PlySurfel {
        position: [point.x as f32, point.y as f32, point.z as f32],
        ..PlySurfel::default()
    };
    near_mesh.chain(near_depth).chain(odd).map(surfel).collect()
}

/// The model follows three quarters of the motion; one row has an unknown id, one an unknown frame.
fn tracked_points() -> Vec<TrackedPoint> {
    let mut rows = Vec::new();
    for frame in 0..FRAMES {
        for id in (0..POINTS).filter(|id| id % 6 != 5 && frame >= id % 4) {
            let (start, now) = (truth_point(id, 0), truth_point(id, frame));
            let error = Vector3::new(f64::from(id).sin(), f64::from(id * frame).cos(), 0.5) * 1e-4;
            let point_in_world = world_from_recorded() * (start + (now - start) * 0.75 + error);
            rows.push(TrackedPoint { frame, id, point_in_world });
        }
    }
    for (frame, id) in [(3, 9_999), (500, 1)] {
        rows.push(TrackedPoint { frame, id, point_in_world: Point3::origin() });
    }
    rows
}
