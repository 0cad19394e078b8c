//! Stereo videos, and the data sets that come as such, made here with FFmpeg; skipped, visibly, without it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use common::config;
use common::data_set::{DataSet, RIG};
use flate2::Compression;
use flate2::write::GzEncoder;
use geometry::{Raster, Rgb};
use recording::import::ImportKind;
use recording::{Calibration, RecordingReader, decode_rgb, encode_png_gray};

const EYE: (u32, u32) = (32, 24);
const FRAMES: u8 = 4;

#[derive(Clone, Copy)]
enum Eyes {
    SideBySide,
    TopBottom,
    OneOf(bool),
}

fn has_ffmpeg() -> bool {
    let found = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).status().is_ok();
    if !found {
        eprintln!("skipped: FFmpeg is not there; config/setup.sh installs it");
    }
    found
}

/// Red on the left, blue on the right, green by the frame's number.
fn colour(frame: u8, is_right: bool) -> [u8; 3] {
    let green = 40 + 40 * frame;
    if is_right { [30, green, 200] } else { [200, green, 30] }
}

fn picture(eyes: Eyes, frame: u8) -> Rgb {
    let (width, height) = match eyes {
        Eyes::SideBySide => (2 * EYE.0, EYE.1),
        Eyes::TopBottom => (EYE.0, 2 * EYE.1),
        Eyes::OneOf(_) => EYE,
    };
    Raster::from_fn(width, height, |x, y| {
        let is_right = match eyes {
            Eyes::SideBySide => x >= EYE.0,
            Eyes::TopBottom => y >= EYE.1,
            Eyes::OneOf(is_right) => is_right,
        };
        colour(frame, is_right)
    })
}

/// A video of four pictures, ten a second.
fn record(path: &Path, eyes: Eyes, codec: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let (width, height) = picture(eyes, 0).size();
    let mut ffmpeg = Command::new("ffmpeg")
        .args([
            "-v",
            "error",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
            "-r",
            "10",
            "-s",
            &format!("{width}x{height}"),
        ])
        .args(["-i", "-", "-c:v", codec, "-q:v", "1"])
        .arg(path)
        .stdin(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = ffmpeg.stdin.take().unwrap();
    for frame in 0..FRAMES {
        input.write_all(picture(eyes, frame).pixels().as_flattened()).unwrap();
    }
    drop(input);
    assert!(ffmpeg.wait().unwrap().success());
}

/// Which frames' colours the recorded pairs have; both eyes must agree.
fn frames_seen(set: &DataSet) -> Vec<u8> {
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let pairs = reader.stereo().unwrap().map(|pair| {
        let pair = pair.unwrap();
        let [left, right] = [&pair.left, &pair.right].map(|image| decode_rgb(image, EYE).unwrap()[(9, 9)]);
        let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) < 16);
        let is_frame = |frame: &u8| near(left, colour(*frame, false)) && near(right, colour(*frame, true));
        (0..FRAMES).find(is_frame).unwrap_or_else(|| panic!("{left:?} {right:?}"))
    });
    pairs.collect()
}

#[test]
fn a_video_is_taken_apart_as_the_calibration_tells() {
    if !has_ffmpeg() {
        return;
    }
    for (name, eyes) in [("side.mkv", Eyes::SideBySide), ("stacked.mkv", Eyes::TopBottom)] {
        let set = DataSet::new();
        set.file("rig.toml", RIG.as_bytes());
        let video = set.path().join(name);
        record(&video, eyes, "ffv1");
        let summary = set.import_from(ImportKind::Video, &video, Some(&set.path().join("rig.toml"))).unwrap();
        assert_eq!((summary.pairs, summary.poses), (4, 0));
        assert_eq!((frames_seen(&set), set.stamps_ms()), (vec![0, 1, 2, 3], vec![0, 100, 200, 300]));
    }
}

#[test]
fn a_video_for_each_eye_is_read() {
    if !has_ffmpeg() {
        return;
    }
    let set = DataSet::new();
    set.file("rig.toml", RIG.as_bytes());
    let rig = set.path().join("rig.toml");
    record(&set.path().join("left.mkv"), Eyes::OneOf(false), "ffv1");
    let told = set.import(ImportKind::Video, Some(&rig)).unwrap_err().to_string();
    assert!(told.contains("no right.*"), "{told}");
    record(&set.path().join("right.mp4"), Eyes::OneOf(true), "mpeg4");
    set.import(ImportKind::Video, Some(&rig)).unwrap();
    assert_eq!(frames_seen(&set), [0, 1, 2, 3]);
}

#[test]
fn a_video_that_cannot_be_used_is_named_with_the_reason() {
    if !has_ffmpeg() {
        return;
    }
    let set = DataSet::new();
    let (rig, video) = (set.path().join("rig.toml"), set.path().join("v.mkv"));
    set.file("rig.toml", RIG.replace("width_px = 32", "width_px = 40").as_bytes());
    record(&video, Eyes::SideBySide, "ffv1");
    let refusal = |calibration| {
        let refused = set.import_from(ImportKind::Video, &video, calibration);
        refused.unwrap_err().to_string()
    };
    assert!(refusal(None).contains("--calibration"));
    let told = refusal(Some(rig.as_path()));
    assert!(told.contains("v.mkv: pictures of 64x24") && told.contains("80x24 side by side"), "{told}");
    let bytes = fs::read(&video).unwrap();
    fs::write(&video, &bytes[..bytes.len() / 10]).unwrap();
    assert!(refusal(Some(rig.as_path())).contains("v.mkv"));
    fs::write(&video, b"no video").unwrap();
    assert!(refusal(Some(rig.as_path())).contains("v.mkv: FFmpeg cannot read it"));
    fs::remove_file(&video).unwrap();
    assert!(refusal(Some(rig.as_path())).contains("v.mkv: no such video file"));
}

fn stereomis() -> DataSet {
    let set = DataSet::new();
    let camera = |name: &str, shift: &str| {
        let rotation: String = (0..9).map(|i| format!("R_{i} = {}\n", u8::from(i % 4 == 0))).collect();
        format!(
            "[{name}]\nres_x = 32\nres_y = 24\nfc_x = 40\nfc_y = 40\ncc_x = 15.5\ncc_y = 11.5\nkc_0 = 0\nkc_1 = 0\n\
             {rotation}T_0 = {shift}\nT_1 = 0\nT_2 = 0\n"
        )
    };
    let ini = camera("StereoLeft", "0") + &camera("StereoRight", "-4.2");
    set.file("StereoCalibration.ini", ini.as_bytes());
    record(&set.path().join("IFBS_ENDOSCOPE-part0001.mp4"), Eyes::TopBottom, "mpeg4");
    let poses: String = (0..4).map(|i| format!("{i} 0.0{i} 0 0 0 0 0 1\n")).collect();
    set.file("groundtruth.txt", poses.as_bytes());
    // Half the size, tissue white.
    let mask = encode_png_gray(&Raster::from_fn(16, 12, |x, _| if x < 4 { 0 } else { 255 })).unwrap();
    set.file("masks/000002l.png", &mask.bytes);
    set
}

#[test]
fn stereomis_is_read_with_poses_masks_and_its_usable_frames() {
    if !has_ffmpeg() {
        return;
    }
    let set = stereomis();
    let summary = set.import(ImportKind::Stereomis, None).unwrap();
    assert_eq!((summary.pairs, summary.poses, summary.masks), (4, 4, 1));
    set.file("test_split.csv", b"start,end\n1,2\n");
    let summary = set.import(ImportKind::Stereomis, None).unwrap();
    let Calibration::Raw(raw) = summary.calibration else { panic!("not raw") };
    assert!((raw.right_from_left.translation.x + 0.0042).abs() < 1e-12);
    assert_eq!((frames_seen(&set), set.stamps_ms()), (vec![1, 2], vec![100, 200]));
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    assert!((reader.poses().unwrap()[1].world_from_camera.translation.x - 0.02).abs() < 1e-12);
    let mask = reader.stereo().unwrap().nth(1).unwrap().unwrap().mask.unwrap();
    let mask = recording::decode_gray(&mask, EYE).unwrap();
    assert_eq!((mask[(3, 3)], mask[(12, 3)]), (255, 0), "instruments are white, at full size");
}

#[test]
fn stereomis_that_is_broken_names_file_and_line() {
    if !has_ffmpeg() {
        return;
    }
    let set = stereomis();
    set.file("groundtruth.txt", b"0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 7\n");
    assert!(set.refusal(ImportKind::Stereomis).contains("groundtruth.txt: line 2"));
    set.file("groundtruth.txt", b"").file("test_split.csv", b"start,end\none,2\n");
    assert!(set.refusal(ImportKind::Stereomis).contains("test_split.csv"));
    fs::remove_file(set.path().join("IFBS_ENDOSCOPE-part0001.mp4")).unwrap();
    assert!(set.refusal(ImportKind::Stereomis).contains("0 videos"));
}

#[test]
fn a_clip_of_scared_is_read_with_the_poses_of_its_archive() {
    if !has_ffmpeg() {
        return;
    }
    let set = DataSet::new();
    set.image("Left_Image.png").image("Right_Image.png");
    let calibration = "%YAML:1.0\n---\nM1: [40, 0, 15.5, 0, 40, 11.5, 0, 0, 1]\nD1: [0, 0, 0, 0]\n\
        M2: [40, 0, 15.5, 0, 40, 11.5, 0, 0, 1]\nD2: [0, 0, 0, 0]\nR: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [-4, 0, 0]\n";
    set.file("endoscope_calibration.yaml", calibration.as_bytes());
    record(&set.path().join("data/rgb.mp4"), Eyes::TopBottom, "mpeg4");
    let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
    for number in 0..4 {
        let text = format!(
            "{{\"camera-pose\": [[1, 0, 0, {}.0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], \"timestamp\": 1}}",
            -5 * number
        );
        let mut header = tar::Header::new_gnu();
        header.set_size(text.len() as u64);
        header.set_cksum();
        archive.append_data(&mut header, format!("frame_data{number:06}.json"), text.as_bytes()).unwrap();
    }
    set.file("data/frame_data.tar.gz", &archive.into_inner().unwrap().finish().unwrap());
    let summary = set.import(ImportKind::Scared, None).unwrap();
    assert_eq!((summary.pairs, summary.poses, summary.depths), (4, 4, 0));
    assert_eq!(frames_seen(&set), [0, 1, 2, 3]);
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let pose = reader.poses().unwrap()[2].world_from_camera;
    assert!((pose.translation.vector - nalgebra::Vector3::new(0.01, 0.0, 0.0)).norm() < 1e-9, "{pose}");
    set.file("data/frame_data.tar.gz", b"no archive");
    assert!(set.import(ImportKind::Scared, None).unwrap_err().to_string().contains("frame_data.tar.gz"));
}
