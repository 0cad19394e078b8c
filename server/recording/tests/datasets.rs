//! The importers on real data, which lies beside the workspace and is not part of it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::path::{Path, PathBuf};
use std::time::Instant;

use common::{config, shared_data};
use geometry::{Eye, Rectification};
use recording::import::{ImportKind, ImportRequest, ImportSummary, import};
use recording::{Calibration, RecordingReader, decode_gray};

/// A data set imported into a file that goes with it.
struct Imported {
    _folder: tempfile::TempDir,
    recording: PathBuf,
    summary: ImportSummary,
}

fn imported(kind: ImportKind, source: &Path) -> Imported {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("recording.mcap");
    let request = ImportRequest::new(kind, source, &recording);
    let mut calls = 0;
    let start = Instant::now();
    let summary = import(&request, &config(), &mut |done, total| {
        calls += 1;
        assert!(done == calls && done <= total);
    })
    .unwrap();
    assert_eq!(calls, summary.pairs);
    let bytes = std::fs::metadata(&recording).unwrap().len();
    eprintln!("{kind}: {} pairs, {bytes} bytes in {:?}", summary.pairs, start.elapsed());
    Imported { _folder: folder, recording, summary }
}

impl Imported {
    fn reader(&self) -> RecordingReader {
        RecordingReader::open(&self.recording, &config()).unwrap()
    }

    /// Stamps in frames of `frame_rate_hz`.
    fn frame_numbers(&self, frame_rate_hz: f64) -> Vec<u64> {
        let stamps = common::replayed_stamps(&self.reader());
        stamps.into_iter().map(|stamp_ns| (stamp_ns as f64 * frame_rate_hz / 1e9).round() as u64).collect()
    }
}

#[test]
fn hamlyn_frames_keep_their_numbers_as_times() {
    for (set, expected, frame_rate_hz) in [
        ("6", (1..=1201).step_by(50).collect::<Vec<_>>(), 30.0),
        ("20", (801..=2401).step_by(100).collect(), 25.0),
    ] {
        let Some(source) = shared_data(&format!("hamlyn/{set}")) else { return };
        let set = imported(ImportKind::Hamlyn, &source);
        assert_eq!(set.frame_numbers(frame_rate_hz), expected);
        assert_eq!(set.reader().calibration().unwrap(), set.summary.calibration);
    }
}

#[test]
fn images_are_copied_byte_by_byte_and_decode() {
    let Some(source) = shared_data("hamlyn/6") else { return };
    let set = imported(ImportKind::Hamlyn, &source);
    let pair = set.reader().stereo().unwrap().nth(2).unwrap().unwrap();
    assert_eq!(pair.right.bytes, std::fs::read(source.join("right/101.png")).unwrap());
    let gray = decode_gray(&pair.left, set.summary.calibration.image_size_px()).unwrap();
    assert!(gray.pixels().iter().any(|&value| value > 128));
}

#[test]
fn bdis_depth_belongs_to_its_image_even_where_numbering_is_shifted() {
    for (set, pairs) in [("30", 10), ("32", 25)] {
        let Some(source) = shared_data(&format!("bdis_synth/{set}")) else { return };
        let set = imported(ImportKind::Bdis, &source);
        assert_eq!((set.summary.pairs, set.summary.depths), (pairs, pairs));
        let (own, next) = (photometric_error(&set.reader(), 0), photometric_error(&set.reader(), 1));
        assert!(own < 0.7 * next, "{own} grey levels with its own depth, {next} with the next one's");
    }
}

/// Mean difference (grey levels) of left pixels from the right pixels where the depth `skip` frames later puts them.
fn photometric_error(reader: &RecordingReader, skip: usize) -> f64 {
    let Calibration::Rectified(rig) = reader.calibration().unwrap() else { panic!("not rectified") };
    let size = (rig.left.width_px, rig.left.height_px);
    let (mut sum, mut count) = (0.0, 0.0);
    for (pair, depth) in reader.stereo().unwrap().zip(reader.depths().unwrap().skip(skip)) {
        let (pair, depth) = (pair.unwrap(), depth.unwrap());
        assert_eq!(pair.stamp_ns == depth.stamp_ns, skip == 0);
        let (left, right) = (decode_gray(&pair.left, size).unwrap(), decode_gray(&pair.right, size).unwrap());
        for (x, y) in (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))) {
            let disparity_px = rig.disparity_px(f64::from(depth.depth[(x, y)]));
            let there = right.get((f64::from(x) - disparity_px).round() as i64, i64::from(y));
            if let (true, Some(&value)) = (disparity_px < 300.0, there) {
                sum += f64::from(left[(x, y)].abs_diff(value));
                count += 1.0;
            }
        }
    }
    sum / count
}

#[test]
fn kitti_comes_with_its_rig_and_poses() {
    let Some(source) = shared_data("kitti/seq1") else { return };
    let set = imported(ImportKind::Kitti, &source);
    assert_eq!((set.summary.pairs, set.summary.poses), (31, 31));
    let Calibration::Rectified(rig) = set.summary.calibration else { panic!("not rectified") };
    assert!((rig.baseline_m - 0.5372).abs() < 1e-4, "{}", rig.baseline_m);
    assert_eq!((rig.left.width_px, rig.left.height_px, rig.left.fx_px), (1226, 370, 707.0912));
    let poses = set.reader().poses().unwrap();
    let path: Vec<_> = poses.iter().map(|pose| pose.world_from_camera).collect();
    let length_m = geometry::trajectory::path_length_m(&path);
    assert!((35.0..37.0).contains(&length_m), "{length_m}");
    assert_eq!(poses[30].stamp_ns, 3_000_000_000);
}

#[test]
fn euroc_stays_raw_with_poses_of_the_rectified_left_camera() {
    let Some(source) = shared_data("euroc") else { return };
    let set = imported(ImportKind::Euroc, &source);
    assert_eq!((set.summary.pairs, set.summary.poses), (100, 100));
    let (Calibration::Raw(planned), Calibration::Raw(read)) =
        (set.summary.calibration, set.reader().calibration().unwrap())
    else {
        panic!("rectified")
    };
    assert_eq!((planned.left, planned.right), (read.left, read.right));
    let difference = planned.right_from_left.inverse() * read.right_from_left;
    assert!(
        difference.translation.vector.norm() < 1e-12 && difference.rotation.angle() < 1e-9,
        "{difference}"
    );
    let rectification = Rectification::from_calibration(&read).unwrap();
    let turn_deg = rectification.rectified_from_raw(Eye::Left).rotation.angle().to_degrees();
    assert!(turn_deg < 2.0, "{turn_deg}");
    assert!((rectification.rig().baseline_m - 0.110).abs() < 1e-3);
    let stamps = common::replayed_stamps(&set.reader());
    assert_eq!(stamps[0], 1_403_715_273_262_142_976);
    assert_eq!(set.reader().poses().unwrap()[0].stamp_ns, stamps[0]);
}

#[test]
fn d4d_keeps_masks_and_depth() {
    let Some(source) = shared_data("d4d_clip") else { return };
    let set = imported(ImportKind::D4d, &source);
    assert_eq!((set.summary.pairs, set.summary.masks, set.summary.depths), (120, 120, 24));
    assert_eq!(set.frame_numbers(30.0), (0..120).collect::<Vec<_>>());
    let reader = set.reader();
    assert!(reader.stereo().unwrap().all(|pair| pair.unwrap().mask.is_some()));
    let depth = reader.depths().unwrap().nth(3).unwrap().unwrap();
    assert_eq!(depth.stamp_ns, 500_000_000);
    let mut known: Vec<f32> = depth.depth.pixels().iter().copied().filter(|&z| z > 0.0).collect();
    known.sort_by(f32::total_cmp);
    // f * B of 2.608 px * m at 21 to 47 px of disparity.
    let median = known[known.len() / 2];
    assert!((0.05..0.13).contains(&median), "{median}");
}

#[test]
fn a_public_recording_of_a_simulated_liver_is_read_in_full() {
    let Some(path) = shared_data("sim_liver.mcap") else { return };
    let reader = RecordingReader::open(&path, &config()).unwrap();
    assert!(!reader.truncated());
    let Calibration::Rectified(rig) = reader.calibration().unwrap() else { panic!("not rectified") };
    assert_eq!((rig.left.fx_px, rig.left.width_px), (520.0, 640));
    assert!((rig.baseline_m - 0.005).abs() < 1e-12);
    assert_eq!(reader.expected_pairs(), Some(200));
    let stamps = common::replayed_stamps(&reader);
    assert_eq!(stamps.len(), 200);
    assert_eq!(reader.poses().unwrap().iter().map(|pose| pose.stamp_ns).collect::<Vec<_>>(), stamps);
    assert_eq!(reader.depths().unwrap().map(Result::unwrap).count(), 15);
    let points: Vec<_> = reader.points().unwrap().map(Result::unwrap).collect();
    assert!(
        points.len() == 200 && points.iter().all(|p| p.ids.len() == 2000 && p.points_in_world.len() == 2000)
    );
    assert_eq!(reader.attachment("truth_mesh.npz").unwrap().unwrap().len(), 4_596_250);
    assert_eq!(reader.attachment("other").unwrap(), None);
    assert_eq!(reader.metadata().unwrap()["simulation"]["scene"], "liver");
}
