//! Recordings are exchanged with the public Python packages, in both directions.
//!
//! The interpreter is `$MIS_SLAM_PYTHON` or `python3`; without the packages of `tests/compat/requirements.txt` these
//! tests say that they are skipped.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::path::Path;
use std::process::Command;

use common::{config, stamp};
use geometry::Rgb;
use recording::export::{PlySurfel, write_pfm, write_ply};
use recording::{
    Calibration, Compression, RecordingConfig, RecordingReader, RecordingWriter, Topics, decode_gray,
    decode_rgb,
};
use serde::Deserialize;

const FIRST_STAMP_NS: u64 = 1_700_000_000_000_000_000;

fn interpreter() -> String {
    std::env::var("MIS_SLAM_PYTHON").unwrap_or_else(|_| "python3".into())
}

/// Runs a script of `tests/compat`; `None`, and a word about it, where the packages are not installed.
fn python(script: &str, arguments: &[&str]) -> Option<String> {
    let imports = "import foxglove_schemas_protobuf, mcap, mcap_protobuf, numpy, rosbags";
    let probe = Command::new(interpreter()).args(["-c", imports]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: {} lacks the packages of tests/compat/requirements.txt", interpreter());
        return None;
    }
    let script = common::workspace_root().join("tests/compat").join(script);
    let output = Command::new(interpreter()).arg(script).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap())
}

/// What `read_recording.py` prints.
#[derive(Deserialize)]
struct Seen {
    topics: std::collections::BTreeMap<String, SeenTopic>,
    attachments: std::collections::BTreeMap<String, String>,
    metadata: serde_json::Value,
    messages: u64,
    chunks: u64,
}

#[derive(Deserialize)]
struct SeenTopic {
    schema: String,
    stamps: Vec<u64>,
    first: serde_json::Value,
}

#[test]
fn public_tools_read_every_channel_that_is_written() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.mcap");
        write_with_outputs(&path, &RecordingConfig { compression, ..config() });
        let Some(json) = python("read_recording.py", &[path.to_str().unwrap()]) else { return };
        check_seen(&serde_json::from_str(&json).unwrap());
    }
}

fn write_with_outputs(path: &Path, config: &RecordingConfig) {
    let mut writer = RecordingWriter::create(path, config).unwrap();
    writer.write_metadata("simulation", [("scene".to_owned(), "liver".to_owned())].into()).unwrap();
    writer.write_calibration(stamp(0), &Calibration::Rectified(common::rig())).unwrap();
    for index in 0..45 {
        common::write_frame(&mut writer, index);
    }
    writer.write_model(stamp(45), &[PlySurfel::default(); 4]).unwrap();
    writer.attach(stamp(0), "truth_mesh.npz", "application/octet-stream", b"abc").unwrap();
    writer.finish().unwrap();
}

fn check_seen(seen: &Seen) {
    let topics = config().topics;
    assert_eq!(seen.messages, 2 + 45 * 6 + 1);
    assert!(seen.chunks >= 2, "45 frames are more than one flush");
    let frames: Vec<u64> = (0..45).map(stamp).collect();
    for (topic, schema) in [
        (&topics.left_image, "foxglove.CompressedImage"),
        (&topics.right_image, "foxglove.CompressedImage"),
        (&topics.left_mask, "foxglove.CompressedImage"),
        (&topics.truth_pose, "foxglove.PoseInFrame"),
        (&topics.truth_depth, "foxglove.RawImage"),
        (&topics.truth_points, "foxglove.PointCloud"),
    ] {
        assert_eq!(seen.topics[topic].schema, schema, "{topic}");
        assert_eq!(seen.topics[topic].stamps, frames, "{topic}");
    }
    let first = |topic: &String| &seen.topics[topic].first;
    assert_eq!(first(&topics.left_image)["format"], "jpeg");
    assert_eq!(first(&topics.left_mask)["format"], "png");
    assert_eq!(first(&topics.right_calibration)["P"][3], -40.0 * 0.005);
    assert_eq!(first(&topics.truth_depth)["size"], serde_json::json!([32, 24]));
    assert_eq!(first(&topics.truth_points)["id"], serde_json::json!([3, 1, 2]));
    assert_eq!(first(&topics.truth_points)["x"], serde_json::json!([0.0, 0.25, 0.5]));
    assert_eq!(first(&topics.truth_pose)["pose"][1], -0.2);
    assert_eq!(first(&topics.model), &serde_json::json!({"count": 4, "bytes": 140}));
    // The SHA-256 of "abc".
    assert!(seen.attachments["truth_mesh.npz"].starts_with("ba7816bf8f01cfea"));
    assert_eq!(seen.metadata["simulation"]["scene"], "liver");
}

#[test]
fn recordings_of_the_public_writer_play_whatever_their_chunks() {
    for chunking in ["none", "lz4", "zstd", "unchunked"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.mcap");
        if python("write_recording.py", &[path.to_str().unwrap(), chunking]).is_none() {
            return;
        }
        let reader = RecordingReader::open(&path, &config()).unwrap();
        assert!(!reader.truncated(), "{chunking}");
        check_rig(&reader);
        let pairs: Vec<_> = reader.stereo().unwrap().map(Result::unwrap).collect();
        assert_eq!(pairs.len(), 8, "{chunking}");
        assert_eq!(pairs[7].stamp_ns, FIRST_STAMP_NS + 7 * 40_000_000);
        assert_eq!(decode_rgb(&pairs[3].right, (16, 12)).unwrap(), Rgb::filled(16, 12, [3, 6, 9]));
        assert_eq!(reader.poses().unwrap()[7].world_from_camera.translation.x, 0.007);
    }
}

#[test]
fn bags_of_pypi_rosbags_play() {
    for compression in ["none", "storage"] {
        let folder = tempfile::tempdir().unwrap();
        let bag = folder.path().join("bag");
        if python("write_rosbag.py", &[bag.to_str().unwrap(), compression]).is_none() {
            return;
        }
        let topics = Topics {
            left_image: "/left/image_rect".into(),
            right_image: "/right/image_rect".into(),
            left_calibration: "/left/camera_info".into(),
            right_calibration: "/right/camera_info".into(),
            ..config().topics
        };
        let config = RecordingConfig { topics, ..config() };
        let reader = RecordingReader::open(&bag.join("bag.mcap"), &config).unwrap();
        check_rig(&reader);
        let pairs: Vec<_> = reader.stereo().unwrap().map(Result::unwrap).collect();
        assert_eq!(pairs.len(), 12);
        assert_eq!(pairs[11].stamp_ns, FIRST_STAMP_NS + 11 * 50_000_000);
        let right = decode_gray(&pairs[11].right, (16, 12)).unwrap();
        assert_eq!(right[(3, 2)], 2 * 16 + 3 + 11 + 1);
    }
}

fn check_rig(reader: &RecordingReader) {
    let Calibration::Rectified(rig) = reader.calibration().unwrap() else { panic!("not rectified") };
    assert_eq!((rig.left.width_px, rig.left.height_px, rig.left.fx_px), (16, 12, 40.0));
    assert!((rig.baseline_m - 0.0045).abs() < 1e-15);
}

#[test]
fn results_are_read_by_numpy() {
    let folder = tempfile::tempdir().unwrap();
    let (ply, pfm) = (folder.path().join("m.ply"), folder.path().join("d.pfm"));
    let surfel =
        |k: u8| PlySurfel { position: [f32::from(k), 1.0, 2.0], color: [k, 0, 9], ..PlySurfel::default() };
    write_ply(&ply, &[surfel(1), surfel(2)]).unwrap();
    write_pfm(&pfm, &geometry::Raster::from_fn(3, 2, |x, y| (x + 10 * y) as f32)).unwrap();
    let Some(json) = python("read_results.py", &[ply.to_str().unwrap(), pfm.to_str().unwrap()]) else {
        return;
    };
    let seen: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(seen["x"], serde_json::json!([1.0, 2.0]));
    assert_eq!(seen["red"], serde_json::json!([1, 2]));
    assert_eq!(seen["depth"], serde_json::json!([[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]));
}
