//! The importers of endoscopic stills, on small data sets made here in the published layouts, whole and broken.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at what it does not expect")]

mod common;

use std::fs;
use std::io::Cursor;

use common::config;
use common::data_set::{DataSet, RIG};
use geometry::Raster;
use image::codecs::tiff::TiffEncoder;
use image::{ExtendedColorType, ImageBuffer, ImageEncoder, Luma};
use recording::import::{ImportKind, ImportRequest};
use recording::{Calibration, RecordingReader, encode_png_gray};

/// SCARED's calibration of cameras that look the same way, 4 mm apart.
const SCARED: &str = "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 40., 0., 15.5, 0., 40., 11.5, 0., 0., 1. ]\n\
    D1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\n\
    M2: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 40., 0., 15.5, 0., 40., 11.5, 0., 0., 1. ]\n\
    D2: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 0., 0., 0., 0., 0. ]\n\
    R: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]\n\
    T: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ -4., 0., 0. ]\n";

/// A map of the points of a wall 80 mm away, unknown in its first row.
fn point_map(width: u32, height: u32) -> Vec<u8> {
    let mut values = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let ray = [(x as f32 - 15.5) / 40.0, (y as f32 - 11.5) / 40.0, 1.0];
            let point = if y == 0 { [f32::NAN; 3] } else { ray.map(|part| part * 80.0) };
            values.extend(point.iter().flat_map(|value| value.to_ne_bytes()));
        }
    }
    let mut file = Cursor::new(Vec::new());
    TiffEncoder::new(&mut file).write_image(&values, width, height, ExtendedColorType::Rgb32F).unwrap();
    file.into_inner()
}

fn gray16(value: u16) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let image: ImageBuffer<Luma<u16>, Vec<u16>> = ImageBuffer::from_pixel(32, 24, Luma([value]));
    image.write_to(&mut file, image::ImageFormat::Png).unwrap();
    file.into_inner()
}

fn scared() -> DataSet {
    let set = DataSet::new();
    set.file("endoscope_calibration.yaml", SCARED.as_bytes());
    set.image("Left_Image.png").image("Right_Image.png").file("left_depth_map.tiff", &point_map(32, 24));
    set
}

#[test]
fn a_still_of_scared_has_the_depth_of_its_points() {
    let set = scared();
    let summary = set.import(ImportKind::Scared, None).unwrap();
    assert_eq!((summary.pairs, summary.depths, summary.poses), (1, 1, 0));
    let Calibration::Raw(raw) = summary.calibration else { panic!("not raw") };
    assert!((raw.right_from_left.translation.x + 0.004).abs() < 1e-12 && raw.left.pinhole.width_px == 32);
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let depth = reader.depths().unwrap().next().unwrap().unwrap().depth;
    let known: Vec<f32> = depth.pixels().iter().copied().filter(|&depth_m| depth_m > 0.0).collect();
    assert!(known.len() > 500 && known.iter().all(|depth_m| (depth_m - 0.08).abs() < 1e-4), "{known:?}");
}

#[test]
fn scared_that_is_incomplete_or_damaged_names_the_file() {
    let set = scared();
    for (name, bytes, named) in [
        ("left_depth_map.tiff", b"no picture".to_vec(), "left_depth_map.tiff"),
        ("left_depth_map.tiff", point_map(16, 24), "16x24 points"),
        (
            "endoscope_calibration.yaml",
            SCARED.replace("M2:", "M3:").into_bytes(),
            "endoscope_calibration.yaml: M2",
        ),
        ("data/rgb.mp4", b"no video".to_vec(), "rgb.mp4"),
    ] {
        let set = scared();
        set.file(name, &bytes);
        let told = set.refusal(ImportKind::Scared);
        assert!(told.contains(named) || told.contains("FFmpeg: install it"), "{name}: {told}");
    }
    fs::remove_file(set.path().join("Right_Image.png")).unwrap();
    assert!(set.refusal(ImportKind::Scared).contains("Right_Image.png"));
}

fn servct_calibration(baseline_mm: f64) -> String {
    let shift = -40.0 * baseline_mm;
    format!(
        "{{\"P1\": {{\"rows\": 3, \"cols\": 4, \"data\": [40, 0, 15.5, 0, 0, 40, 11.5, 0, 0, 0, 1, 0]}},\n\
         \"P2\": [[40, 0, 14.0, {shift}], [0, 40, 11.5, 0], [0, 0, 1, 0]], \"Q\": []}}"
    )
}

fn servct() -> DataSet {
    let set = DataSet::new();
    for number in ["001", "002"] {
        set.image(&format!("Left_rectified/{number}.png")).image(&format!("Right_rectified/{number}.png"));
        set.file(&format!("Rectified_calibration/{number}.json"), servct_calibration(5.0).as_bytes());
        set.file(&format!("Ground_truth_CT/DepthL/{number}.png"), &gray16(25_600));
    }
    set
}

#[test]
fn serv_ct_is_read_with_its_reference_depth() {
    let set = servct();
    let summary = set.import(ImportKind::Servct, None).unwrap();
    assert_eq!((summary.pairs, summary.depths), (2, 2));
    let Calibration::Rectified(rig) = summary.calibration else { panic!("not rectified") };
    assert!((rig.baseline_m - 0.005).abs() < 1e-12 && rig.right_cx_px == 14.0, "{rig:?}");
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let depth_m = reader.depths().unwrap().next().unwrap().unwrap().depth[(3, 3)];
    assert!((depth_m - 0.1).abs() < 1e-6, "{depth_m}");
}

#[test]
fn pairs_of_serv_ct_with_different_calibrations_are_imported_one_by_one() {
    let set = servct();
    set.file("Rectified_calibration/002.json", servct_calibration(5.5).as_bytes());
    let told = set.refusal(ImportKind::Servct);
    assert!(told.contains("002.json") && told.contains("Left_rectified/NNN.png"), "{told}");
    let (source, recording) = (set.path().join("Left_rectified/002.png"), set.recording());
    let request = ImportRequest::new(ImportKind::Servct, &source, &recording);
    let summary = recording::import::import(&request, &config(), &mut |_, _| {}).unwrap();
    let Calibration::Rectified(rig) = summary.calibration else { panic!("not rectified") };
    assert!(summary.pairs == 1 && (rig.baseline_m - 0.0055).abs() < 1e-12, "{rig:?}");
}

#[test]
fn a_calibration_of_serv_ct_that_is_wrong_names_the_field() {
    for (from, to, named) in [
        ("\"P2\"", "\"P3\"", "P2 is missing"),
        ("-200", "200", "P2[3]"),
        ("[40, 0, 15.5", "[0, 0, 15.5", "focal lengths 0"),
        ("14.0, ", "", "P2 has 11 numbers"),
        ("14.0", "\"wide\"", "P2 is no matrix"),
        ("{", "", "001.json"),
    ] {
        let set = servct();
        set.file("Rectified_calibration/001.json", servct_calibration(5.0).replacen(from, to, 1).as_bytes());
        let told = set.refusal(ImportKind::Servct);
        assert!(told.contains("001.json") && told.contains(named), "{from}: {told}");
    }
}

/// `poses_bounds.npy` of a camera that looks along the world's z axis.
fn poses_bounds(frames: usize, focal_px: f64) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({frames}, 17), }}");
    let padded = format!("{header:<117}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((padded.len() as u16).to_le_bytes());
    bytes.extend(padded.as_bytes());
    // Columns: down, right, backward, place, height width focal.
    let row =
        [0.0, 1.0, 0.0, 0.3, 24.0, 1.0, 0.0, 0.0, 0.0, 32.0, 0.0, 0.0, -1.0, 0.0, focal_px, 10.0, 200.0];
    for _ in 0..frames {
        bytes.extend(row.iter().flat_map(|value| f64::to_le_bytes(*value)));
    }
    bytes
}

fn endonerf() -> DataSet {
    let set = DataSet::new();
    for number in 0..2 {
        set.image(&format!("images/frame-{number:06}.color.png"));
        set.image(&format!("images_right/frame-{number:06}.color.png"));
        let mask = encode_png_gray(&Raster::from_fn(32, 24, |x, _| if x < 8 { 255 } else { 0 })).unwrap();
        set.file(&format!("masks/frame-{number:06}.mask.png"), &mask.bytes);
    }
    set.file("poses_bounds.npy", &poses_bounds(2, 40.0)).file("rig.toml", RIG.as_bytes());
    set
}

#[test]
fn endonerf_is_read_with_masks_and_the_pose_of_its_still_camera() {
    let set = endonerf();
    assert!(set.refusal(ImportKind::Endonerf).contains("--calibration"));
    let rig = set.path().join("rig.toml");
    let summary = set.import(ImportKind::Endonerf, Some(&rig)).unwrap();
    assert_eq!((summary.pairs, summary.masks, summary.poses, summary.depths), (2, 2, 2, 0));
    assert_eq!(set.stamps_ms(), [0, 100]);
    let reader = RecordingReader::open(&set.recording(), &config()).unwrap();
    let pose = reader.poses().unwrap()[1].world_from_camera;
    assert!(pose.rotation.angle() < 1e-12 && (pose.translation.x - 0.3).abs() < 1e-12, "{pose}");
    let mask = reader.stereo().unwrap().next().unwrap().unwrap().mask.unwrap();
    let mask = recording::decode_gray(&mask, (32, 24)).unwrap();
    assert_eq!((mask[(2, 2)], mask[(20, 2)]), (255, 0));
}

#[test]
fn endonerf_that_does_not_fit_its_calibration_names_the_file() {
    let set = endonerf();
    let rig = set.path().join("rig.toml");
    let refusal = |bytes: &[u8]| {
        set.file("poses_bounds.npy", bytes);
        set.import(ImportKind::Endonerf, Some(&rig)).unwrap_err().to_string()
    };
    assert!(refusal(&poses_bounds(2, 55.0)).contains("poses_bounds.npy: frame 0: focal length 55 px"));
    assert!(refusal(&poses_bounds(3, 40.0)).contains("3 poses for 2 pairs"));
    assert!(refusal(b"no array").contains("poses_bounds.npy"));
    let cut = poses_bounds(2, 40.0);
    assert!(refusal(&cut[..cut.len() - 8]).contains("poses_bounds.npy"));
}

#[test]
fn a_frame_rate_is_refused_where_each_pair_has_its_own_stamp() {
    let set = DataSet::new();
    let (source, recording) = (set.path(), set.recording());
    for kind in [ImportKind::Euroc, ImportKind::Ros2bag] {
        let request =
            ImportRequest { frame_rate_hz: Some(20.0), ..ImportRequest::new(kind, &source, &recording) };
        let told = recording::import::import(&request, &config(), &mut |_, _| {}).unwrap_err().to_string();
        assert!(told.contains("a stamp for each pair"), "{told}");
    }
}

#[test]
fn a_frame_rate_that_is_given_takes_the_place_of_the_sets_own() {
    let set = DataSet::new();
    set.file("rig.toml", RIG.as_bytes()).pairs(&["1", "2"]);
    let (source, recording) = (set.path(), set.recording());
    let plain = ImportRequest::new(ImportKind::Folder, &source, &recording);
    let request = ImportRequest { frame_rate_hz: Some(20.0), ..plain };
    recording::import::import(&request, &config(), &mut |_, _| {}).unwrap();
    assert_eq!(set.stamps_ms(), [0, 50]);
    let refused = ImportRequest { frame_rate_hz: Some(f64::NAN), ..plain };
    let told = recording::import::import(&refused, &config(), &mut |_, _| {}).unwrap_err().to_string();
    assert!(told.contains("frame rate of NaN"), "{told}");
}

#[test]
fn a_folder_can_be_calibrated_by_another_tools_file_at_a_rate_that_is_named() {
    let set = DataSet::new();
    let calibration = set.path().join("stereo.yaml");
    set.pairs(&["1", "2"]).file("stereo.yaml", SCARED.as_bytes());
    let told = set.import(ImportKind::Folder, Some(&calibration)).unwrap_err().to_string();
    assert!(told.contains("--frame-rate"), "{told}");
    let (source, recording) = (set.path(), set.recording());
    let request = ImportRequest {
        calibration: Some(&calibration),
        frame_rate_hz: Some(25.0),
        ..ImportRequest::new(ImportKind::Folder, &source, &recording)
    };
    recording::import::import(&request, &config(), &mut |_, _| {}).unwrap();
    assert_eq!(set.stamps_ms(), [0, 40]);
}
