//! What is written is read again.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use common::{config, jpeg, picture, pose, raw_image, rig, stamp};
use geometry::trajectory::StampedPose;
use geometry::{CameraModel, Distortion, Pinhole, Pose, StereoCalibration};
use nalgebra::{Translation3, UnitQuaternion};
use recording::export::PlySurfel;
use recording::{
    Calibration, Compression, RawPixel, RecordingConfig, RecordingError, RecordingReader, RecordingWriter,
    Topics,
};

/// Writes with `write` and opens what was written.
fn recorded(
    config: &RecordingConfig,
    write: impl FnOnce(&mut RecordingWriter),
) -> (tempfile::TempDir, RecordingReader) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.mcap");
    let mut writer = RecordingWriter::create(&path, config).unwrap();
    write(&mut writer);
    writer.finish().unwrap();
    (folder, RecordingReader::open(&path, config).unwrap())
}

#[test]
fn pairs_from_a_time_on_and_the_span_of_all_are_found_with_and_without_an_index() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rec.mcap");
    common::write_recording(&path, 40, &config());
    let whole = std::fs::read(&path).unwrap();
    let torn = folder.path().join("torn.mcap");
    std::fs::write(&torn, &whole[..whole.len() - 20]).unwrap();
    for path in [path, torn] {
        let reader = RecordingReader::open(&path, &config()).unwrap();
        assert_eq!(reader.stereo_span_ns().unwrap(), (stamp(0), stamp(39)));
        let stamps = reader.stereo_from(stamp(25)).unwrap().map(|pair| pair.unwrap().stamp_ns);
        assert!(stamps.eq((25..40).map(stamp)));
        assert_eq!(reader.stereo_from(stamp(39) + 1).unwrap().count(), 0);
    }
}

#[test]
fn every_channel_comes_back_with_every_compression() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let config = RecordingConfig { compression, ..config() };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.mcap");
        common::write_recording(&path, 5, &config);
        check_everything(&RecordingReader::open(&path, &config).unwrap());
    }
}

fn check_everything(reader: &RecordingReader) {
    assert!(!reader.truncated());
    assert_eq!(reader.calibration().unwrap(), Calibration::Rectified(rig()));
    assert_eq!(reader.expected_pairs(), Some(5));
    let pairs: Vec<_> = reader.stereo().unwrap().map(Result::unwrap).collect();
    assert_eq!(pairs.len(), 5);
    for (index, pair) in (0..).zip(&pairs) {
        assert_eq!(pair.stamp_ns, stamp(index));
        assert_eq!((&pair.left, &pair.right), (&jpeg(2 * index as u32), &jpeg(2 * index as u32 + 1)));
        assert!(pair.mask.is_some());
    }
    for (index, truth) in (0..).zip(reader.poses().unwrap()) {
        let difference = truth.world_from_camera.inverse() * pose(index);
        assert!(difference.translation.vector.norm() < 1e-15 && difference.rotation.angle() < 1e-7);
    }
    let depths: Vec<_> = reader.depths().unwrap().map(Result::unwrap).collect();
    assert_eq!(depths[3].depth[(2, 4)], 0.001 * 9.0_f32);
    let points: Vec<_> = reader.points().unwrap().map(Result::unwrap).collect();
    assert_eq!(points, (0..5).map(common::points).collect::<Vec<_>>());
    assert_eq!(reader.attachment("truth_mesh.npz").unwrap(), Some(vec![7; 1000]));
    assert_eq!(reader.metadata().unwrap()["simulation"]["scene"], "liver");
}

#[test]
fn a_raw_calibration_keeps_lenses_and_the_motion_between_the_eyes() {
    let camera = |fx_px, distortion| CameraModel {
        pinhole: Pinhole { width_px: 320, height_px: 240, fx_px, fy_px: 250.0, cx_px: 158.0, cy_px: 121.0 },
        distortion,
    };
    let raw = StereoCalibration {
        left: camera(251.0, Distortion::RadialTangential([-0.2, 0.05, 1e-3, -2e-3, 0.0])),
        right: camera(249.0, Distortion::Rational([-0.1, 0.02, 1e-4, 2e-4, 0.0, 0.05, 1e-3, 0.0])),
        right_from_left: Pose::from_parts(
            Translation3::new(-0.0043, 1e-4, -2e-4),
            UnitQuaternion::from_euler_angles(0.01, -0.02, 0.005),
        ),
    };
    let (_folder, reader) = recorded(&config(), |writer| {
        writer.write_calibration(stamp(0), &Calibration::Raw(raw)).unwrap();
    });
    let Calibration::Raw(read) = reader.calibration().unwrap() else { panic!("not raw") };
    assert_eq!((read.left, read.right), (raw.left, raw.right));
    let difference = raw.right_from_left.inverse() * read.right_from_left;
    assert!(difference.translation.vector.norm() < 1e-12, "{difference}");
    assert!(difference.rotation.angle() < 1e-7, "{difference}");
}

#[test]
fn raw_images_keep_their_layout() {
    let bytes = picture(1).pixels().as_flattened().to_vec();
    let image = raw_image(common::WIDTH, common::HEIGHT, RawPixel::Rgb8, bytes);
    let (_folder, reader) =
        recorded(&config(), |writer| writer.write_pair(stamp(1), &image, &image).unwrap());
    let pair = reader.stereo().unwrap().next().unwrap().unwrap();
    assert_eq!((&pair.left, &pair.right), (&image, &image));
}

#[test]
fn outputs_are_kept_apart_from_truth() {
    let estimate = StampedPose { stamp_ns: stamp(1), world_from_camera: pose(1) };
    let (_folder, reader) = recorded(&config(), |writer| {
        writer.write_pose(&estimate).unwrap();
        writer.write_model(stamp(1), &[PlySurfel::default(); 3]).unwrap();
    });
    assert!(reader.poses().unwrap().is_empty());
    assert_eq!(reader.estimated_poses().unwrap()[0].stamp_ns, stamp(1));
}

#[test]
fn topics_can_be_renamed() {
    let topics = Topics { left_image: "/cam/l".into(), right_image: "/cam/r".into(), ..config().topics };
    let renamed = RecordingConfig { topics, ..config() };
    let (folder, reader) = recorded(&renamed, |writer| {
        writer.write_pair(stamp(0), &jpeg(0), &jpeg(1)).unwrap();
    });
    assert_eq!(common::replayed_stamps(&reader), [stamp(0)]);
    let other = RecordingReader::open(&folder.path().join("r.mcap"), &config()).unwrap();
    let error = other.stereo().err().unwrap().to_string();
    assert!(error.contains("/stereo/left/image") && error.contains("/cam/l, /cam/r"), "{error}");
}

#[test]
fn a_missing_calibration_is_named_with_its_topic() {
    let (_folder, reader) =
        recorded(&config(), |writer| writer.write_pair(stamp(0), &jpeg(0), &jpeg(1)).unwrap());
    let error = reader.calibration().unwrap_err();
    assert!(matches!(&error, RecordingError::MissingTopic { key: "left_calibration", .. }), "{error}");
}

#[test]
fn truth_that_is_not_there_is_empty() {
    let (_folder, reader) =
        recorded(&config(), |writer| writer.write_pair(stamp(0), &jpeg(0), &jpeg(1)).unwrap());
    assert!(reader.poses().unwrap().is_empty());
    assert_eq!(reader.depths().unwrap().count() + reader.points().unwrap().count(), 0);
}

#[test]
fn a_file_that_is_no_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [("empty", &b""[..]), ("text", b"hello, this is not a recording")] {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        let error = RecordingReader::open(&path, &config()).err().unwrap();
        assert!(matches!(error, RecordingError::Container { .. }), "{error}");
    }
    let error = RecordingReader::open(&folder.path().join("absent"), &config()).err().unwrap();
    assert!(matches!(error, RecordingError::Io { .. }), "{error}");
}
