//! The importers on small data sets made here, whole and broken.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::fs;

use common::data_set::{DataSet, RIG};
use common::{config, rig};
use geometry::Raster;
use recording::import::ImportKind;
use recording::{Calibration, RecordingReader, encode_png_gray, encode_png_rgb};

#[test]
fn a_folder_of_pairs_is_recorded_in_natural_order_at_its_frame_rate() {
    let set = DataSet::new();
    set.file("rig.toml", RIG.as_bytes()).pairs(&["frame2", "frame10", "frame1"]);
    let summary = set.import(ImportKind::Folder, None).unwrap();
    assert_eq!((summary.pairs, summary.calibration), (3, Calibration::Rectified(rig())));
    assert_eq!(set.stamps_ms(), [0, 100, 200]);
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let last = reader.stereo().unwrap().last().unwrap().unwrap();
    assert_eq!(last.left.bytes, fs::read(set.path().join("left/frame10.png")).unwrap());
    assert_eq!(reader.metadata().unwrap()["import"]["source"], "set");
}

#[test]
fn an_eye_that_is_missing_is_named() {
    let set = DataSet::new();
    set.file("rig.toml", RIG.as_bytes()).pairs(&["1", "2"]).image("left/3.png");
    let told = set.refusal(ImportKind::Folder);
    assert!(told.contains("left/3.png") && told.contains("right image is missing"), "{told}");
    fs::rename(set.path().join("left/3.png"), set.path().join("right/3.png")).unwrap();
    assert!(set.refusal(ImportKind::Folder).contains("left image is missing"));
}

#[test]
fn an_image_that_does_not_fit_the_calibration_is_named() {
    let set = DataSet::new();
    let small = encode_png_rgb(&Raster::filled(8, 8, [0; 3])).unwrap().bytes;
    set.file("rig.toml", RIG.as_bytes()).pairs(&["1", "2"]).file("right/2.png", &small);
    let told = set.refusal(ImportKind::Folder);
    assert!(told.contains("right/2.png") && told.contains("8x8") && told.contains("32x24"), "{told}");
    set.file("right/2.png", b"no image");
    assert!(set.refusal(ImportKind::Folder).contains("right/2.png"));
}

#[test]
fn a_folder_without_calibration_or_images_says_what_to_do() {
    let set = DataSet::new();
    set.pairs(&["1"]);
    assert!(set.refusal(ImportKind::Folder).contains("--calibration"));
    fs::remove_dir_all(set.path().join("left")).unwrap();
    set.file("rig.toml", RIG.as_bytes()).file("left/readme.txt", b"");
    assert!(set.refusal(ImportKind::Folder).contains("no JPEG or PNG"));
}

#[test]
fn a_rig_file_that_is_wrong_names_the_key() {
    let set = DataSet::new();
    set.pairs(&["1"]);
    for (from, to, named) in [
        ("fx_px", "focal", "focal"),
        ("frame_rate_hz = 10.0", "frame_rate_hz = 0.0", "frame_rate_hz"),
        ("[rectified]", "[rectify]", "rectify"),
        ("fy_px = 41.0\n", "", "fy_px"),
    ] {
        set.file("rig.toml", RIG.replace(from, to).as_bytes());
        let told = set.refusal(ImportKind::Folder);
        assert!(told.contains("rig.toml") && told.contains(named), "{told}");
    }
}

#[test]
fn a_rig_file_can_hold_raw_cameras() {
    let set = DataSet::new();
    let camera = "width_px = 32\nheight_px = 24\nfx_px = 40.0\nfy_px = 40.0\ncx_px = 15.5\ncy_px = 11.5\n\
        distortion_model = \"plumb_bob\"\ndistortion = [-0.1, 0.01, 0.0, 0.0]\n";
    let text = format!(
        "frame_rate_hz = 30.0\n[raw]\nright_from_left_rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]\n\
         right_from_left_translation_mm = [-5.0, 0.0, 0.0]\n[raw.left]\n{camera}[raw.right]\n{camera}"
    );
    set.file("rig.toml", text.as_bytes()).pairs(&["1"]);
    let summary = set.import(ImportKind::Folder, None).unwrap();
    let Calibration::Raw(raw) = summary.calibration else { panic!("not raw") };
    assert!((raw.right_from_left.translation.x + 0.005).abs() < 1e-15);
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    assert!(matches!(reader.calibration().unwrap(), Calibration::Raw(_)));
    set.file("rig.toml", text.replace("[1, 0, 0,", "[2, 0, 0,").as_bytes());
    fs::remove_file(set.recording()).unwrap();
    assert!(set.refusal(ImportKind::Folder).contains("right_from_left_rotation"));
}

#[test]
fn a_hamlyn_set_that_is_not_known_asks_for_its_rig() {
    let set = DataSet::new();
    set.pairs(&["1", "101"]).file("rig.toml", RIG.as_bytes());
    assert!(set.refusal(ImportKind::Hamlyn).contains("--calibration"));
    set.import(ImportKind::Hamlyn, Some(&set.path().join("rig.toml"))).unwrap();
    assert_eq!(set.stamps_ms(), [100, 10_100]);
}

#[test]
fn kitti_in_the_benchmarks_own_layout_is_read() {
    let set = DataSet::new();
    for name in ["image_0/000000.png", "image_1/000000.png", "image_0/000001.png", "image_1/000001.png"] {
        set.image(name);
    }
    let camera = |shift: &str| format!("40.0 0 15.5 {shift} 0 40.0 11.5 0 0 0 1 0");
    let calibration: String = (0..4)
        .zip(["0", "-5.0", "2.0", "-3.0"])
        .map(|(i, shift)| format!("P{i}: {}\n", camera(shift)))
        .collect();
    set.file("calib.txt", calibration.as_bytes()).file("times.txt", b"0.0\n1.035e-01\n");
    let summary = set.import(ImportKind::Kitti, None).unwrap();
    let Calibration::Rectified(rig) = summary.calibration else { panic!("not rectified") };
    assert!((rig.baseline_m - 0.125).abs() < 1e-15 && summary.poses == 0, "{rig:?}");
    assert_eq!(set.stamps_ms(), [0, 103]);
}

#[test]
fn kitti_with_a_short_or_wrong_file_names_file_and_line() {
    let set = DataSet::new();
    for name in ["image_l/0.png", "image_r/0.png", "image_l/1.png", "image_r/1.png"] {
        set.image(name);
    }
    let row = "40 0 15.5 0 0 40 11.5 0 0 0 1 0\n";
    set.file("calib.txt", row.as_bytes());
    assert!(set.refusal(ImportKind::Kitti).contains("calib.txt: 12 numbers"));
    set.file("calib.txt", row.repeat(2).as_bytes()).file("poses.txt", b"1 0 0 0 0 1 0 0 0 0 1 0\n");
    assert!(set.refusal(ImportKind::Kitti).contains("poses.txt: it has no line for"));
    for line in ["1 2 x", "1 2 3", "1 0 0 0 0 1 0 nan 0 0 1 0", "2 0 0 0 0 1 0 0 0 0 1 0"] {
        set.file("poses.txt", format!("1 0 0 0 0 1 0 0 0 0 1 0\n{line}\n").as_bytes());
        let told = set.refusal(ImportKind::Kitti);
        assert!(told.contains("poses.txt: line 2"), "{told}");
    }
}

const SENSOR: &str = "%YAML:1.0\n# sensor\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, SHIFT,\n    0.0, 1.0, 0.0, 0.0,\n\
    \x20   0.0, 0.0, 1.0, 0.0,\n    0.0, 0.0, 0.0, 1.0]\ncamera_model: pinhole\nresolution: [32, 24]\n\
    intrinsics: [40.0, 40.0, 15.5, 11.5]\ndistortion_model: radial-tangential\n\
    distortion_coefficients: [-0.28, 0.07, 0.0002, 1.76e-05]\n";

#[test]
fn euroc_in_its_own_layout_is_read() {
    let set = DataSet::new();
    for (camera, shift) in [("cam0", "0.0"), ("cam1", "0.11")] {
        set.file(&format!("mav0/{camera}/sensor.yaml"), SENSOR.replace("SHIFT", shift).as_bytes());
        set.image(&format!("mav0/{camera}/data/1403636579763555584.png"));
    }
    let truth = "#timestamp, p_RS_R_x [m], ...\n1403636579763555300,4.5,-1.5,0.5,0.0,1.0,0.0,0.0,0.1,0.2\n\
        1403636579768555584,9,9,9,1,0,0,0,0,0\n";
    set.file("mav0/state_groundtruth_estimate0/data.csv", truth.as_bytes());
    let summary = set.import(ImportKind::Euroc, None).unwrap();
    assert_eq!((summary.pairs, summary.poses), (1, 1));
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let Calibration::Raw(raw) = reader.calibration().unwrap() else { panic!("not raw") };
    assert!((raw.right_from_left.translation.x + 0.11).abs() < 1e-12);
    let pose = reader.poses().unwrap()[0];
    assert_eq!(pose.stamp_ns, 1_403_636_579_763_555_584);
    assert!(
        (pose.world_from_camera.translation.vector - nalgebra::Vector3::new(4.5, -1.5, 0.5)).norm() < 1e-12
    );
}

#[test]
fn euroc_with_a_camera_that_makes_no_sense_names_what_is_wrong() {
    let set = DataSet::new();
    for (from, to, named) in [
        ("radial-tangential", "equidistant", "equidistant"),
        ("[1.0, 0.0", "[.nan, 0.0", "T_BS"),
        ("intrinsics", "intrinsic", "intrinsics is missing"),
        ("[32, 24]", "[32, x]", "resolution"),
        ("%YAML:1.0", "{", "cam0_sensor.yaml"),
    ] {
        let sensor = SENSOR.replace("SHIFT", "0.0").replacen(from, to, 1);
        set.file("cam0_sensor.yaml", sensor.as_bytes()).image("images/1_0.jpg");
        let told = set.refusal(ImportKind::Euroc);
        assert!(told.contains("cam0_sensor.yaml") && told.contains(named), "{told}");
    }
}

#[test]
fn bdis_depth_numbered_from_zero_belongs_to_images_numbered_from_one() {
    for (first_depth, expected_m) in [(1, [1.0, 2.0]), (0, [0.0, 1.0])] {
        let set = DataSet::new();
        let text = RIG.replace("frame_rate_hz = 10.0", "frame_rate_hz = 10.0\ndepth_unit_mm = 1000.0");
        set.pairs(&["1", "2"]).file("rig.toml", text.as_bytes());
        for number in first_depth..3 {
            // Green 255 is 100 units; a whole unit is 2.55 of it.
            let depth = Raster::filled(32, 24, [0, (f64::from(number) * 2.55).round() as u8, 0]);
            set.file(&format!("depth_rg/depth_{number:07}.png"), &encode_png_rgb(&depth).unwrap().bytes);
        }
        let summary = set.import(ImportKind::Bdis, Some(&set.path().join("rig.toml"))).unwrap();
        assert_eq!(summary.depths, 2);
        let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
        let depths = reader.depths().unwrap().map(|depth| f64::from(depth.unwrap().depth[(3, 3)]));
        assert_eq!(depths.collect::<Vec<_>>(), expected_m);
    }
}

#[test]
fn depth_of_the_wrong_kind_is_named() {
    let set = DataSet::new();
    let text = RIG.replace("frame_rate_hz = 10.0", "frame_rate_hz = 10.0\ndepth_unit_mm = 0.01");
    set.pairs(&["1"]).image("mask/1.png").file("rig.toml", text.as_bytes());
    set.file("depth16/1.png", &encode_png_gray(&Raster::filled(32, 24, 9)).unwrap().bytes);
    let rig = set.path().join("rig.toml");
    let told = set.import(ImportKind::D4d, Some(&rig)).unwrap_err().to_string();
    assert!(told.contains("depth16/1.png") && told.contains("16-bit"), "{told}");
}

#[test]
fn every_kind_has_a_name_that_leads_back_to_it() {
    for kind in ImportKind::ALL {
        assert_eq!(kind.name().parse(), Ok(kind));
    }
    assert!("nothing".parse::<ImportKind>().unwrap_err().contains("folder, hamlyn, bdis"));
}
