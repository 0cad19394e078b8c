//! What the tests of this crate share.
#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "a test ends at what it does not expect")]

pub mod data_set;

use std::path::{Path, PathBuf};

use geometry::trajectory::StampedPose;
use geometry::{Pinhole, Pose, Raster, Rgb, StereoRig};
use nalgebra::{Point3, Translation3, UnitQuaternion};
use recording::{
    Calibration, EncodedImage, ImageFormat, RecordingConfig, RecordingReader, RecordingWriter, TruthPoints,
    encode_jpeg,
};
use serde::Deserialize;

pub const WIDTH: u32 = 32;
pub const HEIGHT: u32 = 24;

pub fn workspace_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// Section `[recording]` of the documented defaults.
pub fn config() -> RecordingConfig {
    #[derive(Deserialize)]
    struct File {
        recording: RecordingConfig,
    }
    let text = std::fs::read_to_string(workspace_root().join("config/server.toml")).unwrap();
    toml::from_str::<File>(&text).unwrap().recording
}

/// A file of the research data beside the workspace; says so where it is absent.
pub fn shared_data(name: &str) -> Option<PathBuf> {
    let path = workspace_root().join("../shared/data").join(name);
    if !path.exists() {
        eprintln!("skipped: ../shared/data/{name} is not there");
        return None;
    }
    Some(path)
}

pub fn rig() -> StereoRig {
    let left =
        Pinhole { width_px: WIDTH, height_px: HEIGHT, fx_px: 40.0, fy_px: 41.0, cx_px: 15.5, cy_px: 11.5 };
    StereoRig { left, baseline_m: 0.005, right_cx_px: 14.0 }
}

/// A picture that differs with `seed` and from pixel to pixel.
pub fn picture(seed: u32) -> Rgb {
    Raster::from_fn(WIDTH, HEIGHT, |x, y| [(x * 8) as u8, (y * 10) as u8, (seed * 37 + x * y) as u8])
}

pub fn jpeg(seed: u32) -> EncodedImage {
    encode_jpeg(&picture(seed), 90).unwrap()
}

pub fn pose(index: u64) -> Pose {
    let turn = UnitQuaternion::from_euler_angles(0.01 * index as f64, -0.02, 0.3);
    Pose::from_parts(Translation3::new(0.001 * index as f64, -0.2, 0.05), turn)
}

pub fn stamp(index: u64) -> u64 {
    1_760_000_000_000_000_000 + index * 33_333_333
}

pub fn points(index: u64) -> TruthPoints {
    let point = |k: u32| Point3::new(f64::from(k) * 0.25, index as f64 * 0.5, 0.0625);
    TruthPoints { stamp_ns: stamp(index), ids: vec![3, 1, 2], points_in_world: (0..3).map(point).collect() }
}

/// Writes a recording with `frames` frames of every channel.
pub fn write_recording(path: &Path, frames: u64, config: &RecordingConfig) {
    let mut writer = RecordingWriter::create(path, config).unwrap();
    writer.write_metadata("simulation", [("scene".to_owned(), "liver".to_owned())].into()).unwrap();
    writer.write_calibration(stamp(0), &Calibration::Rectified(rig())).unwrap();
    for index in 0..frames {
        write_frame(&mut writer, index);
    }
    writer.attach(stamp(0), "truth_mesh.npz", "application/octet-stream", &[7; 1000]).unwrap();
    writer.finish().unwrap();
}

pub fn write_frame(writer: &mut RecordingWriter, index: u64) {
    let stamp_ns = stamp(index);
    writer.write_pair(stamp_ns, &jpeg(2 * index as u32), &jpeg(2 * index as u32 + 1)).unwrap();
    let mask = Raster::from_fn(WIDTH, HEIGHT, |x, _| if x < index as u32 { 255 } else { 0 });
    writer.write_mask(stamp_ns, &recording::encode_png_gray(&mask).unwrap()).unwrap();
    writer.write_truth_pose(&StampedPose { stamp_ns, world_from_camera: pose(index) }).unwrap();
    let depth = Raster::from_fn(WIDTH, HEIGHT, |x, y| 0.001 * (x + y + index as u32) as f32);
    writer.write_truth_depth(stamp_ns, &depth).unwrap();
    writer.write_truth_points(&points(index)).unwrap();
}

/// The stamps of all pairs, having checked that each is its own frame's.
pub fn replayed_stamps(reader: &RecordingReader) -> Vec<u64> {
    reader.stereo().unwrap().map(|pair| pair.unwrap().stamp_ns).collect()
}

pub fn raw_image(width: u32, height: u32, pixel: recording::RawPixel, bytes: Vec<u8>) -> EncodedImage {
    let row_bytes = width * pixel.bytes();
    EncodedImage { format: ImageFormat::Raw { width, height, row_bytes, pixel }, bytes }
}
