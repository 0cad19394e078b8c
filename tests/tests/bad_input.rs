//! Bad input to the commands: a clear message, exit status 2, nothing lost (design section 11).

#![expect(clippy::unwrap_used, reason = "a failed step fails the test")]

use std::path::Path;

use tests::{data, process};

fn refused(arguments: &[&str], paths: &[&Path]) -> String {
    let mut command = process::program("mis-slam");
    command.args(arguments).args(paths);
    let output = process::run_any(command);
    assert_eq!(output.status.code(), Some(2), "{}", process::described(&output));
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn wrong_usage_ends_with_2_and_says_what_is_expected() {
    assert!(refused(&["replay"], &[]).contains("REC.mcap"));
    assert!(refused(&["simulate", "spleen", "-o", "x.mcap"], &[]).contains("spleen"));
    assert!(refused(&["doctor", "--set", "rig.nonsense=1"], &[]).contains("nonsense"));
}

#[test]
fn a_missing_recording_is_named() {
    let scratch = tempfile::tempdir().unwrap();
    let missing = scratch.path().join("missing.mcap");
    assert!(refused(&["replay", "--out", "unused"], &[&missing]).contains("missing.mcap"));
}

#[test]
fn a_file_that_is_no_recording_is_refused() {
    let scratch = tempfile::tempdir().unwrap();
    let noise = scratch.path().join("noise.mcap");
    std::fs::write(&noise, [0x5A; 4096]).unwrap();
    let out = scratch.path().join("run");
    let message = refused(&["replay", "--out", out.to_str().unwrap()], &[&noise]);
    assert!(message.contains("noise.mcap"), "{message}");
}

#[test]
fn swapped_eyes_are_refused_with_a_message_that_says_so() {
    let scratch = tempfile::tempdir().unwrap();
    let recording =
        data::simulate(scratch.path(), "liver", &["--size", "320x240", "--frames", "2", "--rigid"]);
    let topics = [
        "--set",
        "recording.topics.left_image=/stereo/right/image",
        "--set",
        "recording.topics.right_image=/stereo/left/image",
    ];
    let out = scratch.path().join("run");
    let arguments = [&["replay", "--out", out.to_str().unwrap()][..], &topics].concat();
    let message = refused(&arguments, &[&recording]);
    assert!(message.contains("swapped"), "{message}");
}

#[test]
fn a_baseline_that_no_scope_has_is_refused_by_name() {
    let scratch = tempfile::tempdir().unwrap();
    let recording = data::simulate(scratch.path(), "liver", &["--size", "320x240", "--frames", "2"]);
    let out = scratch.path().join("run");
    let arguments = ["replay", "--set", "rig.baseline_max_mm=2", "--out", out.to_str().unwrap()];
    let message = refused(&arguments, &[&recording]);
    assert!(message.contains("baseline"), "{message}");
}
