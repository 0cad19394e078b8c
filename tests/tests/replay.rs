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

/// What a trace says of one track, in order of time.
fn of_track<'a>(trace: &'a [Value], process: u64, thread: &str) -> Vec<&'a Value> {
    let named = |record: &&Value| record["name"] == "thread_name" && record["args"]["name"] == thread;
    let name = trace.iter().filter(named).find(|record| record["pid"] == process);
    let track = &name.unwrap_or_else(|| panic!("no track {thread} of process {process}"))["tid"];
    let mut spans: Vec<&Value> = trace
        .iter()
        .filter(|record| record["ph"] == "X" && record["pid"] == process && record["tid"] == *track)
        .collect();
    // A span comes before those inside it.
    spans.sort_by(|a, b| (ends_us(a).0, ends_us(b).1).partial_cmp(&(ends_us(b).0, ends_us(a).1)).unwrap());
    spans
}

/// Begin and end of a span, microseconds.
fn ends_us(span: &Value) -> (f64, f64) {
    let begin = number(&span["ts"]);
    (begin, begin + number(&span["dur"]))
}

/// Times are written to the nanosecond.
const ROUNDING_US: f64 = 2e-3;

fn assert_nested(spans: &[&Value]) {
    let mut around: Vec<f64> = Vec::new();
    for span in spans {
        let (begin, end) = ends_us(span);
        around.retain(|outer| *outer > begin + ROUNDING_US);
        assert!(around.iter().all(|outer| end <= outer + ROUNDING_US), "{span} leaves the span around it");
        around.push(end);
    }
}

fn named<'a>(spans: &[&'a Value], name: &str, frame: u64) -> &'a Value {
    let found = spans.iter().find(|span| span["name"] == name && span["args"]["frame"] == frame);
    found.unwrap_or_else(|| panic!("no {name} of frame {frame}"))
}

#[test]
fn a_trace_shows_the_tracker_at_later_pairs_while_the_gpu_has_one() {
    let scratch = tempfile::tempdir().unwrap();
    let size = ["--size", "320x240", "--frames", "6", "--rigid"];
    let recording = data::simulate(scratch.path(), "liver", &size);
    let file = scratch.path().join("trace.json");
    replay(&recording, &scratch.path().join("run"), &["--trace", file.to_str().unwrap()]);
    let trace: Vec<Value> = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let (tracker, dense) = (of_track(&trace, 1, "tracker"), of_track(&trace, 1, "dense"));
    let gpu = of_track(&trace, 2, "queue");
    for track in [&tracker, &dense, &gpu] {
        assert_nested(track);
    }
    let mut overlaps = 0;
    for frame in 0..6 {
        let passes: Vec<&Value> = gpu.iter().copied().filter(|pass| pass["args"]["frame"] == frame).collect();
        let (begin, end) = ends_us(named(&dense, "fuse pair", frame));
        assert!(passes.len() > 10, "{} passes of frame {frame}", passes.len());
        for pass in passes {
            let (pass_begin, pass_end) = ends_us(pass);
            assert!(begin <= pass_begin + ROUNDING_US && pass_end <= end + ROUNDING_US, "{pass}");
            let is_later =
                |span: &&&Value| span["name"] == "track" && span["args"]["frame"].as_u64() > Some(frame);
            let later = tracker.iter().filter(is_later).map(|span| ends_us(span));
            overlaps += later.filter(|&(begin, end)| begin < pass_end && end > pass_begin).count();
        }
        named(&tracker, "find features", frame);
    }
    assert!(overlaps > 0, "the tracker and the GPU took turns");
}

#[test]
fn the_benchmark_tells_what_each_stage_takes_and_what_can_be_expected() {
    let scratch = tempfile::tempdir().unwrap();
    let file = scratch.path().join("bench.json");
    let mut command = process::program("mis-slam");
    command.args(["bench", "--quick", "--profile", "cpu", "--json"]).arg(&file);
    let printed = String::from_utf8(process::run(command).stdout).unwrap();
    assert!(printed.contains("30 fps sessions") && printed.contains("warp solve"), "{printed}");
    let report: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let [case] = &report["cases"].as_array().unwrap()[..] else { panic!("{report:#}") };
    assert_eq!((&case["profile"], &case["width_px"]), (&"cpu".into(), &320.into()));
    for side in ["tracker", "gpu"] {
        let stages = case["stages"].as_array().unwrap().iter().filter(|stage| stage["side"] == side);
        let share: f64 = stages.map(|stage| number(&stage["share"])).sum();
        assert!((share - 1.0).abs() < 1e-9, "{side}: {share}");
    }
    for figure in ["pairs_per_s", "tracker_ms", "gpu_turn_ms", "cpu_ms", "gpu_mib", "surfels"] {
        assert!(number(&case[figure]) > 0.0, "{figure}: {case:#}");
    }
}

#[test]
fn a_size_that_is_none_is_bad_usage() {
    let mut command = process::program("mis-slam");
    command.args(["bench", "--size", "640"]);
    assert_eq!(process::run_any(command).status.code(), Some(2));
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
