//! Every score equals that of the independent scoring script on the same files.
//!
//! `golden/*.json` hold what `score.py DIR TRUTH.mcap` printed, less the keys that `evaluate` does not have. To make them
//! anew, run this test with `EVALUATION_SCENE_DIR` set to an empty folder, and the script on what it leaves there.

mod scene;

use std::path::{Path, PathBuf};

use serde_json::Value;

/// Room for another platform's sine, and for sums in another order.
const RELATIVE_TOLERANCE: f64 = 1e-7;

/// The folder of the scene, and what deletes it in the end.
fn scene_folder(name: &str) -> (PathBuf, Option<tempfile::TempDir>) {
    if let Some(folder) = std::env::var_os("EVALUATION_SCENE_DIR") {
        let folder = Path::new(&folder).join(name);
        std::fs::create_dir_all(&folder).expect("a writable folder");
        return (folder, None);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    (folder.path().to_path_buf(), Some(folder))
}

fn evaluated(name: &str, with_mesh: bool) -> Value {
    let (folder, _guard) = scene_folder(name);
    let recording = folder.join("truth.mcap");
    scene::write_recording(&recording, with_mesh);
    scene::write_results(&folder);
    let reader = scene::open(&recording);
    let truth = evaluation::Truth::read(&reader).expect("it was written");
    let scores = evaluation::evaluate(&folder, &truth).expect("readable results");
    serde_json::to_value(scores).expect("scores serialise")
}

/// Asserts that `ours` has everything that `golden` has, with the same values; gives the number of values.
fn assert_agrees(path: &str, ours: &Value, golden: &Value) -> usize {
    match golden {
        Value::Object(fields) => fields
            .iter()
            .map(|(key, golden)| {
                let path = format!("{path}.{key}");
                assert_agrees(&path, ours.get(key).unwrap_or(&Value::Null), golden)
            })
            .sum(),
        Value::Number(number) => {
            let golden = number.as_f64().expect("a number");
            let ours = ours.as_f64().unwrap_or(f64::NAN);
            let off = (ours - golden).abs();
            assert!(off <= RELATIVE_TOLERANCE * golden.abs() + 1e-12, "{path}: {ours} for {golden}");
            1
        }
        other => {
            assert_eq!(ours, other, "{path}");
            1
        }
    }
}

#[test]
fn a_simulated_recording_is_scored_as_by_the_script() {
    let golden = serde_json::from_str(include_str!("golden/mesh.json")).expect("json");
    let compared = assert_agrees("mesh", &evaluated("mesh", true), &golden);
    assert!(compared > 50, "{compared} values");
}

#[test]
fn a_recording_without_mesh_is_scored_against_its_last_depth_as_by_the_script() {
    let golden = serde_json::from_str(include_str!("golden/depth.json")).expect("json");
    let compared = assert_agrees("depth", &evaluated("depth", false), &golden);
    assert!(compared > 50, "{compared} values");
}
