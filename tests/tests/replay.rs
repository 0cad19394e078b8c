//! `import`, `replay` and `eval` on simulated and, where present, real recordings.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step fails the test")]

use std::path::{Path, PathBuf};

use serde_json::Value;
use tests::{data, process};

fn replay(recording: &Path, out: &Path, arguments: &[&str]) -> Value {
    let mut command = process::program("mis-slam");
    command.arg("replay").arg(recording).arg("--out").arg(out).args(arguments);
    process::run(command);
    serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap()
}

fn evaluate(out: &Path, truth: &Path) -> Value {
    let mut command = process::program("mis-slam");
    command.arg("eval").arg(out).arg("--truth").arg(truth);
    serde_json::from_slice(&process::run(command).stdout).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn small_liver(directory: &Path) -> PathBuf {
    data::simulate(directory, "liver", &["--size", "320x240", "--frames", "20", "--rigid"])
}

#[test]
fn two_replays_of_a_recording_are_identical_to_the_last_bit() {
    let scratch = tempfile::tempdir().unwrap();
    let recording = small_liver(scratch.path());
    let outs = ["first", "second"].map(|name| scratch.path().join(name));
    for out in &outs {
        replay(&recording, out, &[]);
    }
    for file in ["model.ply", "trajectory.tum", "points.csv"] {
        let [first, second] = outs.each_ref().map(|out| std::fs::read(out.join(file)).unwrap());
        assert!(first == second, "{file} differs");
        assert!(first.len() > 1000, "{file} holds {} bytes", first.len());
    }
}

#[test]
fn a_rigid_scene_is_tracked_measured_and_modelled() {
    let scratch = tempfile::tempdir().unwrap();
    let recording = small_liver(scratch.path());
    let out = scratch.path().join("run");
    let report = replay(&recording, &out, &["--save-depth"]);
    assert_eq!(report["frames"]["tracked"], 20, "{report:#}");
    assert_eq!(std::fs::read_dir(out.join("depth")).unwrap().count(), 20);
    let scores = evaluate(&out, &recording);
    assert!(number(&scores["ate_rmse_mm"]) < 1.0, "{scores:#}");
    assert!(number(&scores["depth_mae_mm"]) < 1.0, "{scores:#}");
    assert!(number(&scores["depth_coverage"]) > 0.8, "{scores:#}");
    assert!(number(&scores["surface_error_mm"]["mean"]) < 1.0, "{scores:#}");
}

#[test]
fn a_truncated_recording_is_replayed_up_to_its_last_good_record_and_says_so() {
    let scratch = tempfile::tempdir().unwrap();
    let whole = small_liver(scratch.path());
    let cut = scratch.path().join("cut.mcap");
    let bytes = std::fs::read(whole).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let report = replay(&cut, &scratch.path().join("run"), &[]);
    assert_eq!(report["truncated"], true);
    let paired = report["frames"]["paired"].as_u64().unwrap();
    assert!((5..20).contains(&paired), "{report:#}");
    assert_eq!(report["frames"]["tracked"], paired);
}

#[test]
fn in_vivo_tissue_is_imported_tracked_and_fused() {
    let Some(hamlyn) = data::shared_data("hamlyn/6") else { return };
    let scratch = tempfile::tempdir().unwrap();
    let recording = scratch.path().join("h6.mcap");
    let mut import = process::program("mis-slam");
    import.args(["import", "hamlyn"]).arg(hamlyn).arg("-o").arg(&recording);
    process::run(import);
    let report = replay(&recording, &scratch.path().join("h6"), &[]);
    assert!(report["frames"]["tracked"].as_u64().unwrap() >= 23, "{report:#}");
    assert!(number(&report["back_projection_mm"]["median"]) < 1.0, "{report:#}");
}
