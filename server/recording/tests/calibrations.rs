//! Calibration files of other tools, made here in their layouts, whole and broken.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

use std::fs;
use std::path::{Path, PathBuf};

use geometry::{Distortion, StereoCalibration};
use recording::{Calibration, CalibrationHints, read_calibration};

const HINTS: CalibrationHints = CalibrationHints { image_px: Some((640, 480)), unit_m: 1e-3 };

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }
}

fn raw(path: &Path) -> StereoCalibration {
    match read_calibration(path, &HINTS).unwrap().calibration {
        Calibration::Raw(raw) => raw,
        Calibration::Rectified(rig) => panic!("rectified: {rig:?}"),
    }
}

fn refusal(path: &Path) -> String {
    read_calibration(path, &HINTS).unwrap_err().to_string()
}

/// The rig that every file of this test describes: two cameras of 640x480, 5 mm apart.
fn check(raw: &StereoCalibration) {
    let (left, right) = (&raw.left.pinhole, &raw.right.pinhole);
    assert_eq!((left.width_px, left.height_px, left.fx_px, left.cy_px), (640, 480, 500.0, 241.0));
    assert_eq!((right.fx_px, right.fy_px, right.cx_px), (502.0, 503.0, 318.0));
    let Distortion::RadialTangential([k1, _, p1, ..]) = raw.left.distortion else { panic!("{raw:?}") };
    assert_eq!((k1, p1), (-0.2, 0.001));
    let right_in_left = raw.right_from_left.inverse().translation.vector;
    assert!((right_in_left - nalgebra::Vector3::new(0.005, 0.0, 0.0)).norm() < 1e-12, "{right_in_left}");
}

/// Replaces each text in turn; the refusal must name the file and the field.
fn check_refusals(folder: &Folder, name: &str, text: &str, wrong: &[(&str, &str, &str)]) {
    for (from, to, named) in wrong {
        assert!(text.contains(from), "{from} is not in the file");
        let told = refusal(&folder.file(name, &text.replacen(from, to, 1)));
        assert!(told.contains(name) && told.contains(named), "{from} -> {to}: {told}");
    }
}

const OPENCV: &str = "%YAML:1.0
---
image_width: 640
image_height: 480
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 501., 241., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -2.0000000000000001e-01, 0.05, 0.001, 0., 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 502., 0., 318., 0., 503., 240., 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 14
   dt: d
   data: [ -0.1, 0.05, 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0., 0. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -5., 0., 0. ]
";

#[test]
fn opencv_is_read_in_the_unit_that_is_said() {
    let folder = Folder::new();
    check(&raw(&folder.file("calibration.yaml", &OPENCV.replace(" 14\n", " 5\n"))));
    let metres = CalibrationHints { unit_m: 1.0, ..HINTS };
    let path = folder.file("metres.yml", &OPENCV.replace("-5., 0., 0.", "-0.005, 0., 0."));
    let Calibration::Raw(raw) = read_calibration(&path, &metres).unwrap().calibration else { panic!() };
    check(&raw);
}

#[test]
fn opencv_without_a_size_takes_that_of_the_images() {
    let folder = Folder::new();
    let path = folder
        .file("endoscope_calibration.yaml", &OPENCV.replace("image_width: 640\nimage_height: 480\n", ""));
    check(&raw(&path));
    check(&raw(folder.0.path()));
    let unknown = CalibrationHints { image_px: None, ..HINTS };
    let told = read_calibration(&path, &unknown).unwrap_err().to_string();
    assert!(told.contains("image_width"), "{told}");
}

#[test]
fn opencv_in_two_files_is_read_from_both() {
    let folder = Folder::new();
    let (cameras, motion) = OPENCV.split_at(OPENCV.find("R: !!").unwrap());
    folder.file("intrinsics.yml", cameras);
    folder.file("extrinsics.yml", &format!("%YAML:1.0\n---\n{motion}"));
    check(&raw(folder.0.path()));
    folder.file("extrinsics.yml", &format!("%YAML:1.0\n---\n{}", motion.replace("T:", "Q:")));
    let told = refusal(folder.0.path());
    assert!(told.contains("extrinsics.yml: T is missing"), "{told}");
}

#[test]
fn opencv_that_makes_no_sense_names_the_field() {
    let wrong = [
        ("500.", "0.", "M1: fx"),
        ("500.", "-500.", "M1: fx"),
        ("500.", ".nan", "M1"),
        ("318.", "9999.", "M2: cx"),
        ("M2:", "M3:", "M2 is missing"),
        ("data: [ 1., 0., 0.,", "data: [ 2., 0., 0.,", "R ="),
        ("-5., 0., 0.", "5., 0., 0.", "are the eyes swapped"),
        ("-5., 0., 0.", "0., 0., 0.", "T = 0"),
        ("-5., 0., 0.", "-5., 0.", "T has 2 numbers"),
        ("image_width: 640", "image_width: 640.5", "image_width"),
        ("image_width: 640", "image_width: 99999999", "image_width"),
        ("0., 0., 0., 0., 0., 0. ]", "0., 0., 0., 0., 0., 7. ]", "D2: thin prisms"),
        ("M1:", "N1:", "no left camera"),
        ("data: [ 500.,", "data: { 500.,", "calibration.yaml"),
    ];
    check_refusals(&Folder::new(), "calibration.yaml", OPENCV, &wrong);
}

fn camera_info(fx: &str, fy: &str, cx: &str, cy: &str, lens: &str, shift: &str) -> String {
    format!(
        "image_width: 640\nimage_height: 480\ncamera_name: eye\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]\n\
         distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{lens}, 0.05, 0.001, 0, 0]\n\
         rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n\
         projection_matrix:\n  rows: 3\n  cols: 4\n  data: [501, 0, 320, {shift}, 0, 501, 240, 0, 0, 0, 1, 0]\n"
    )
}

#[test]
fn ros_camera_info_is_read_from_either_eye() {
    let folder = Folder::new();
    let left = folder.file("left.yaml", &camera_info("500", "501", "320", "241", "-0.2", "0"));
    let right = folder.file("right.yaml", &camera_info("502", "503", "318", "240", "-0.1", "-2.505"));
    for path in [left.as_path(), right.as_path(), folder.0.path()] {
        check(&raw(path));
    }
    let rectified = |fx: &str, shift: &str| {
        camera_info(fx, "501", "320", "240", "0", shift).replace("0, 0.05, 0.001", "0, 0, 0")
    };
    folder.file("left.yaml", &rectified("501", "0"));
    folder.file("right.yaml", &rectified("501", "-2.505"));
    let Calibration::Rectified(rig) = read_calibration(&left, &HINTS).unwrap().calibration else { panic!() };
    assert!((rig.baseline_m - 0.005).abs() < 1e-12);
}

#[test]
fn ros_camera_info_that_makes_no_sense_names_file_and_field() {
    let folder = Folder::new();
    folder.file("left.yaml", &camera_info("500", "501", "320", "241", "-0.2", "0"));
    let right = camera_info("502", "503", "318", "240", "-0.1", "-2.505");
    let wrong = [
        ("image_width", "width", "image_width"),
        ("plumb_bob", "equidistant", "equidistant"),
        ("[502", "[0", "camera_matrix: fx"),
        ("[501", "[0", "projection_matrix: fx"),
        ("[1, 0, 0, 0, 1, 0, 0, 0, 1]", "[1, 0, 0, 0, 1]", "rectification_matrix"),
        ("[1, 0, 0, 0, 1, 0, 0, 0, 1]", "[1, 1, 1, 0, 1, 0, 0, 0, 1]", "R:"),
    ];
    check_refusals(&folder, "right.yaml", &right, &wrong);
    let alone = Folder::new();
    let told = refusal(&alone.file("left.yaml", &right));
    assert!(told.contains("right.yaml") && told.contains("other eye"), "{told}");
    assert!(refusal(&alone.file("eye.yaml", &right)).contains("left or right must be in its name"));
}

const KALIBR: &str = "cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.2, 0.05, 0.001, 0.0]
  distortion_model: radtan
  intrinsics: [500.0, 501.0, 320.0, 241.0]
  resolution: [640, 480]
  rostopic: /left/image_raw
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.005]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  distortion_coeffs: [-0.1, 0.05, 0.0, 0.0]
  distortion_model: radtan
  intrinsics: [502.0, 503.0, 318.0, 240.0]
  resolution: [640, 480]
  rostopic: /right/image_raw
";

#[test]
fn kalibr_is_read_and_what_is_wrong_named() {
    let folder = Folder::new();
    check(&raw(&folder.file("camchain.yaml", KALIBR)));
    check(&raw(folder.0.path()));
    let wrong = [
        ("cam1:", "cam2:", "cam1 is missing"),
        ("T_cn_cnm1", "T_cam_imu", "cam1: T_cn_cnm1 is missing"),
        ("-0.005", "0.005", "cam1: T_cn_cnm1"),
        ("[1.0, 0.0, 0.0, -0.005]", "[1.5, 0.0, 0.0, -0.005]", "no rigid motion"),
        ("radtan", "equidistant", "cam0: distortion_model"),
        ("camera_model: pinhole", "camera_model: omni", "cam0: camera_model"),
        ("intrinsics: [500.0", "intrinsics: [.inf", "cam0: intrinsics"),
        ("resolution: [640, 480]", "resolution: [320, 240]", "cam0"),
        ("resolution: [640, 480]", "resolution: [640]", "resolution has 1 numbers"),
    ];
    check_refusals(&folder, "camchain.yaml", KALIBR, &wrong);
}

fn stereomis_ini() -> String {
    let camera = |name: &str, [fx, fy, cx, cy]: [f64; 4], [k1, p1]: [f64; 2], shift: f64| {
        let rotation: String =
            (0..9).map(|i| format!("R_{i}={}\n", if i % 4 == 0 { 1.0 } else { 0.0 })).collect();
        format!(
            "[{name}]\nres_x=640\nres_y=480\nfc_x={fx}\nfc_y={fy}\ncc_x={cx}\ncc_y={cy}\n\
             kc_0={k1}\nkc_1=0.05\nkc_2={p1}\nkc_3=0\nkc_4=0\nkc_5=0\nkc_6=0\nkc_7=0\n{rotation}T_0={shift}\nT_1=0\nT_2=0\n"
        )
    };
    camera("StereoLeft", [500.0, 501.0, 320.0, 241.0], [-0.2, 0.001], 0.0)
        + &camera("StereoRight", [502.0, 503.0, 318.0, 240.0], [-0.1, 0.0], -5.0)
}

#[test]
fn the_ini_file_of_stereomis_is_read_and_what_is_wrong_named() {
    let folder = Folder::new();
    let text = stereomis_ini();
    check(&raw(&folder.file("StereoCalibration.ini", &text)));
    let wrong = [
        ("[StereoRight]", "[Right]", "[StereoRight] is missing"),
        ("fc_x=500", "fc_x=wide", "StereoLeft: fc_x"),
        ("fc_x=500", "fc_x=0", "StereoLeft: fc, cc: fx"),
        ("cc_y=240", "", "StereoRight: cc_y is missing"),
        ("res_x=640", "res_x=0", "StereoLeft: res_x"),
        ("T_0=-5", "T_0=5", "swapped"),
        ("kc_7=0", "kc_7=nan", "kc holds"),
    ];
    check_refusals(&folder, "StereoCalibration.ini", &text, &wrong);
}

#[test]
fn the_text_files_of_hamlyn_are_read_and_what_is_wrong_named() {
    let folder = Folder::new();
    let left = "500 0 320\n0 501 241\n0 0 1\n\n-0.2 0.05 0.001 0 0\n";
    folder.file("Left_Camera_Calibration_Intrinsic.txt", left);
    folder.file("Right_Camera_Calibration_Intrinsic.txt", "502 0 318\n0 503 240\n0 0 1\n-0.1 0.05 0 0\n");
    let extrinsic = "1.0 0.0 0.0\n0.0 1.0 0.0\n0.0 0.0 1.0\n-5.0 0.0 0.0\n";
    check(&raw(&folder.file("camera_extrinsic.txt", extrinsic)));
    check(&raw(folder.0.path()));
    let wrong = [
        ("1.0 0.0 0.0", "1.0 0.0", "rotation has 8 numbers"),
        ("-5.0", "minus", "translation: \"minus\""),
        ("-5.0 0.0 0.0\n", "", "3 lines"),
        ("1.0 0.0 0.0", "-1.0 0.0 0.0", "no rotation"),
    ];
    check_refusals(&folder, "camera_extrinsic.txt", extrinsic, &wrong);
    folder.file("camera_extrinsic.txt", extrinsic);
    folder.file("Left_Camera_Calibration_Intrinsic.txt", &left.replace("500", "0"));
    let told = refusal(folder.0.path());
    assert!(told.contains("Left_Camera") && told.contains("intrinsic matrix: fx"), "{told}");
}

#[test]
fn what_is_no_calibration_says_what_is_read() {
    let folder = Folder::new();
    assert!(refusal(folder.0.path()).contains("looked for rig.toml"));
    assert!(refusal(&folder.file("a.json", "{}")).contains(".ini"));
    assert!(refusal(&folder.file("empty.yaml", "")).contains("empty.yaml"));
    assert!(refusal(&folder.0.path().join("absent.yaml")).contains("absent.yaml"));
}
