//! Rectification of a real, distorted rig: corresponding points of the two eyes end up on one row.

use geometry::{Gray, Rectification};
use recording::{Calibration, RecordingConfig, RecordingReader};
use serde::Deserialize;
use tests::{data, process};
use tracking::TrackingConfig;
use tracking::feature::{Extractor, ValidityMap};
use tracking::matching::brute_force::mutual_matches;

/// Pairs looked at: every so many of the hundred.
const STRIDE: usize = 10;
/// Matches farther apart in rows are wrong matches, whatever the rectification.
const WRONG_BEYOND_PX: f32 = 10.0;

#[derive(Deserialize)]
struct Config {
    recording: RecordingConfig,
    tracking: TrackingConfig,
}

/// Differences of rows between matching features of the two eyes.
fn row_errors(left: &Gray, right: &Gray, config: &TrackingConfig) -> Vec<f32> {
    let extractor = Extractor::new(&config.features);
    let [left, right] =
        [left, right].map(|image| extractor.extract(image, &ValidityMap::new(image, None, &config.masks)).0);
    let search = &config.search;
    let pairs = mutual_matches(&left.descriptors, &right.descriptors, search.distance_max_bits, 0.8);
    let rows = pairs.into_iter().map(|(l, r)| (left.keypoints[l].pixel.y - right.keypoints[r].pixel.y).abs());
    rows.filter(|error| *error < WRONG_BEYOND_PX).collect()
}

#[test]
fn euroc_is_rectified_to_half_a_row() {
    let Some(euroc) = data::shared_data("euroc") else { return };
    let text = std::fs::read_to_string(data::workspace().join("config/server.toml")).unwrap();
    let config: Config = toml::from_str(&text).unwrap();
    let scratch = tempfile::tempdir().unwrap();
    let path = scratch.path().join("euroc.mcap");
    let mut import = process::program("mis-slam");
    import.args(["import", "euroc"]).arg(euroc).arg("-o").arg(&path);
    process::run(import);

    let reader = RecordingReader::open(&path, &config.recording).unwrap();
    let Calibration::Raw(raw) = reader.calibration().unwrap() else { panic!("EuRoC is not rectified") };
    let rectification = Rectification::from_calibration(&raw).unwrap();
    let size_px = (raw.left.pinhole.width_px, raw.left.pinhole.height_px);
    let mut errors = Vec::new();
    for message in reader.stereo().unwrap().step_by(STRIDE) {
        let message = message.unwrap();
        let [left, right] =
            [&message.left, &message.right].map(|image| recording::decode_gray(image, size_px).unwrap());
        let (left, right) = rectification.rectify_gray(&left, &right).unwrap();
        errors.extend(row_errors(&left, &right, &config.tracking));
    }
    errors.sort_by(f32::total_cmp);
    let median_px = errors[errors.len() / 2];
    println!("median row error {median_px:.3} px over {} matches", errors.len());
    assert!(errors.len() > 500 && median_px < 0.5, "{median_px} px over {} matches", errors.len());
}
