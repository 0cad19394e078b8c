//! `report` on what `replay` wrote.

use std::path::Path;
use std::process::Command;

use tests::{data, process};

fn report(directories: &[&Path], arguments: &[&str]) -> Command {
    let mut command = process::program("mis-slam");
    command.arg("report").args(directories).args(arguments);
    command
}

#[test]
fn a_replayed_recording_gives_a_page_with_every_section_and_a_damaged_run_none() {
    let scratch = tempfile::tempdir().unwrap();
    let recording = data::simulate(scratch.path(), "liver", &["--size", "320x240", "--frames", "8"]);
    let run = scratch.path().join("run");
    let mut replay = process::program("mis-slam");
    replay.arg("replay").arg(&recording).arg("--out").arg(&run).args(["--save-depth", "--views-every", "1"]);
    process::run(replay);

    process::run(report(&[&run], &[]));
    let page = std::fs::read_to_string(run.join("summary.html")).unwrap();
    assert!(
        !page.contains("class=\"absent\"") && !page.contains("class=\"missing\""),
        "all of it was written"
    );
    for shown in ["Over the run", "sagittal (y, z) slice", "warp solve", "Mbit/s", "simulated liver"] {
        assert!(page.contains(shown), "{shown}");
    }
    let figures = std::fs::read_to_string(run.join("summary.figures.json")).unwrap();
    let figures: serde_json::Value = serde_json::from_str(&figures).unwrap();
    assert!(
        figures["runs"][0]["scores"]["point_error_camera_mm"]["mean"].as_f64().unwrap() < 1.0,
        "{figures:#}"
    );

    // Without its recording the run is reported on all the same, and the page says what it lacks.
    std::fs::remove_file(&recording).unwrap();
    let both = scratch.path().join("both.html");
    process::run(report(&[&run, &run], &["-o", both.to_str().unwrap()]));
    let page = std::fs::read_to_string(both).unwrap();
    assert!(page.contains("Comparison") && page.contains("liver.mcap is no longer where it was"));

    std::fs::write(run.join("trajectory.tum"), "0.0 1.0\n").unwrap();
    let refused = process::run_any(report(&[&run], &[]));
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("run/trajectory.tum: line 1"));
}
