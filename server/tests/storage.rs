//! What sessions leave on the disk: journals, results, recovery after a crash, recordings replayed.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::path::{Path, PathBuf};

use geometry::{Pinhole, Rgb, StereoRig};
use protocol::v1::to_server;
use recording::{Calibration, RecordingReader, RecordingWriter};
use serde_json::{Value, json};
use support::{Client, SIZE_PX, TestServer, calibration, defaults, pose, wire_pair};
use tempfile::TempDir;

async fn server_on(directory: &Path) -> TestServer {
    TestServer::start_with(|config| config.storage.directory = directory.to_path_buf()).await
}

async fn open(server: &TestServer, id: &str, record: bool) -> Client {
    let body = json!({"session": id, "calibration": calibration(SIZE_PX), "record": record});
    assert_eq!(server.request("POST", "/api/sessions", Some(body)).await.0, 201);
    server.join(&format!("/api/sessions/{id}/ingest")).await
}

/// Sends pairs one after the other, each when the one before has its pose, so that none is passed over.
async fn feed(cart: &mut Client, sequences: std::ops::Range<u64>) {
    for sequence in sequences {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
        cart.hear_until(|body| pose(body).filter(|pose| pose.sequence == sequence)).await;
    }
}

async fn only_finished(server: &TestServer) -> (String, Vec<String>) {
    let (status, runs) = server.request("GET", "/api/finished", None).await;
    assert_eq!((status, runs.as_array().map(Vec::len)), (200, Some(1)), "{runs}");
    let files = runs[0]["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap().to_owned());
    (runs[0]["run"].as_str().unwrap().to_owned(), files.collect())
}

fn reader(path: &Path) -> RecordingReader {
    RecordingReader::open(path, &defaults().recording).unwrap()
}

#[tokio::test]
async fn a_recorded_session_leaves_its_pairs_and_poses() {
    let folder = TempDir::new().unwrap();
    let server = server_on(folder.path()).await;
    let mut cart = open(&server, "a", true).await;
    feed(&mut cart, 1..8).await;
    assert_eq!(server.state("a").await["recording"], true);
    server.request("DELETE", "/api/sessions/a", None).await;

    let (run, files) = only_finished(&server).await;
    assert_eq!(files, ["trajectory.tum", "recording.mcap"]);
    let (status, bytes) = server.download(&format!("/api/finished/{run}/recording.mcap")).await;
    assert_eq!(status, 200);
    let copy = folder.path().join("copy.mcap");
    std::fs::write(&copy, bytes).unwrap();
    let recording = reader(&copy);
    let stamps: Vec<u64> = recording.stereo().unwrap().map(|pair| pair.unwrap().stamp_ns).collect();
    assert!(stamps.iter().copied().eq((1..8).map(|sequence| wire_pair(sequence).stamp_ns)), "{stamps:?}");
    assert_eq!(recording.estimated_poses().unwrap().len(), 7);
    assert!(!recording.truncated() && recording.calibration().is_ok());
    let (_, trajectory) = server.download(&format!("/api/finished/{run}/trajectory.tum")).await;
    assert_eq!(
        String::from_utf8(trajectory).unwrap().lines().filter(|line| !line.starts_with('#')).count(),
        7
    );

    for path in
        [format!("/api/finished/{run}/journal.mcap"), "/api/finished/..%2F..%2Fetc/report.json".into()]
    {
        assert_eq!(server.request("GET", &path, None).await.0, 404, "{path}");
    }
    assert_eq!(server.request("DELETE", &format!("/api/finished/{run}"), None).await.0, 204);
    assert_eq!(server.request("GET", &format!("/api/finished/{run}"), None).await.0, 404);
}

#[tokio::test]
async fn a_session_that_is_not_recorded_leaves_no_images_and_a_drained_server_leaves_results() {
    let folder = TempDir::new().unwrap();
    let mut server = server_on(folder.path()).await;
    let mut cart = open(&server, "a", false).await;
    feed(&mut cart, 1..4).await;
    server.stop();
    server.ended().await.unwrap();
    let again = server_on(folder.path()).await;
    let (_, files) = only_finished(&again).await;
    assert_eq!(files, ["trajectory.tum"]);
    assert_eq!(again.request("GET", "/api/sessions/a", None).await.0, 404);
}

/// The directory as a killed server leaves it at this moment.
fn as_after_a_crash(directory: &Path, copy: &Path) {
    for entry in std::fs::read_dir(directory.join("open")).unwrap() {
        let run = entry.unwrap().path();
        let to = copy.join("open").join(run.file_name().unwrap());
        std::fs::create_dir_all(&to).unwrap();
        for file in std::fs::read_dir(&run).unwrap() {
            let file = file.unwrap().path();
            std::fs::copy(&file, to.join(file.file_name().unwrap())).unwrap();
        }
    }
}

/// Waits until the journal on the disk holds so many pairs.
async fn journaled(directory: &Path, pairs: usize) {
    support::within(async {
        loop {
            let run = std::fs::read_dir(directory.join("open")).unwrap().next().unwrap().unwrap().path();
            let journal = RecordingReader::open(&run.join("journal.mcap"), &defaults().recording);
            if journal.is_ok_and(|journal| journal.stereo().is_ok_and(|found| found.count() >= pairs)) {
                return;
            }
            tokio::time::sleep(std::time::Duration::from_millis(50)).await;
        }
    })
    .await;
}

#[tokio::test]
async fn what_a_killed_server_was_doing_is_recovered_and_gone_on_with() {
    let (folder, crashed) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let first = server_on(folder.path()).await;
    let mut cart = open(&first, "theatre-3", true).await;
    feed(&mut cart, 1..10).await;
    journaled(folder.path(), 9).await;
    as_after_a_crash(folder.path(), crashed.path());

    let second = server_on(crashed.path()).await;
    let state = second
        .state_when("theatre-3", |state| state["surfels"] == 9 && state["status"] == "source_lost")
        .await;
    assert_eq!(
        (state["poses_published"].as_u64(), state["drops"].as_object().map(serde_json::Map::len)),
        (Some(9), Some(0))
    );
    // Time went on meanwhile: the cart's next stamp is an hour later.
    let mut cart = second.join("/api/sessions/theatre-3/ingest").await;
    feed(&mut cart, 110_000..110_003).await;
    second.request("DELETE", "/api/sessions/theatre-3", None).await;
    let (run, _) = only_finished(&second).await;
    let recording = reader(&crashed.path().join("finished").join(run).join("recording.mcap"));
    assert_eq!(recording.stereo().unwrap().count(), 12);
}

#[tokio::test]
async fn without_room_on_the_disk_the_session_goes_on_and_says_so() {
    let folder = TempDir::new().unwrap();
    let server = TestServer::start_with(|config| {
        config.storage.directory = folder.path().to_path_buf();
        config.storage.free_min_mib = u64::MAX;
        config.recording.flush_interval_ms = 20;
    })
    .await;
    let mut cart = open(&server, "a", true).await;
    feed(&mut cart, 1..3).await;
    let state = server.state_when("a", |state| state["alarms"][0].is_string()).await;
    assert!(state["alarms"][0].as_str().unwrap().contains("free_min_mib"), "{state}");
    assert_eq!(state["recording"], false);
    feed(&mut cart, 3..6).await;
    assert_eq!(server.state("a").await["status"], "live");
    server.request("DELETE", "/api/sessions/a", None).await;
    let (run, files) = only_finished(&server).await;
    assert!(files.contains(&"recording.mcap".to_owned()), "{files:?}");
    let recording = reader(&folder.path().join("finished").join(run).join("recording.mcap"));
    assert!(recording.stereo().unwrap().count() >= 1, "what was written stays readable");
}

#[tokio::test]
async fn a_directory_that_is_gone_keeps_no_session_from_opening() {
    let folder = TempDir::new().unwrap();
    let server = server_on(&folder.path().join("data")).await;
    std::fs::remove_dir_all(folder.path().join("data")).unwrap();
    let mut cart = open(&server, "a", true).await;
    feed(&mut cart, 1..3).await;
    let state = server.state("a").await;
    assert!(state["alarms"][0].as_str().unwrap().contains("nothing is recorded"), "{state}");
}

/// 20 pairs at 100 Hz.
fn recording(folder: &TempDir) -> PathBuf {
    let path = folder.path().join("liver.mcap");
    let (width_px, height_px) = SIZE_PX;
    let left = Pinhole { width_px, height_px, fx_px: 60.0, fy_px: 60.0, cx_px: 32.0, cy_px: 24.0 };
    let rig = StereoRig { left, baseline_m: 0.005, right_cx_px: 32.0 };
    let mut writer = RecordingWriter::create(&path, &defaults().recording).unwrap();
    writer.write_calibration(5, &Calibration::Rectified(rig)).unwrap();
    for number in 0..20 {
        let picture = Rgb::from_fn(width_px, height_px, |x, y| [(x * 3) as u8, (y * 5) as u8, number as u8]);
        let image = recording::encode_jpeg(&picture, 80).unwrap();
        writer.write_pair(5 + number * 10_000_000, &image, &image).unwrap();
    }
    writer.finish().unwrap();
    path
}

async fn replay(server: &TestServer, body: Value) -> Value {
    let (status, opened) = server.request("POST", "/api/sessions", Some(body)).await;
    assert_eq!(status, 201, "{opened}");
    opened
}

#[tokio::test]
async fn an_uploaded_recording_is_replayed_paused_and_moved() {
    let folder = TempDir::new().unwrap();
    let server = server_on(&folder.path().join("data")).await;
    let bytes = std::fs::read(recording(&folder)).unwrap();
    let (status, stored) = server.upload("/api/recordings/liver.mcap", bytes.clone()).await;
    assert_eq!((status, stored["bytes"].as_u64()), (201, Some(bytes.len() as u64)));
    assert_eq!(server.download("/api/recordings/liver.mcap").await, (200, bytes));

    let wanted = json!({"session": "r", "replay": {"recording": "liver.mcap", "rate": 0.0, "paused": true}});
    replay(&server, wanted).await;
    let paused = server.state_when("r", |state| state["replay"]["paused"] == true).await;
    assert_eq!(paused["surfels"], 0, "{paused}");
    assert_eq!(server.refused_upgrade("/api/sessions/r/ingest").await, 409);
    let control = async |body: Value| server.request("POST", "/api/sessions/r/replay", Some(body)).await;
    assert_eq!(control(json!({"paused": false})).await.0, 200);
    let ended =
        server.state_when("r", |state| state["replay"]["ended"] == true && state["surfels"] == 20).await;
    assert_eq!(
        (ended["pairs_received"].as_u64(), ended["drops"].as_object().map(serde_json::Map::len)),
        (Some(20), Some(0))
    );

    // From 0.1 s on ten pairs are left, in a model that starts anew.
    assert_eq!(control(json!({"position_s": 0.1})).await.0, 200);
    let moved = server.state_when("r", |state| state["pairs_received"] == 30 && state["surfels"] == 10).await;
    assert_eq!(moved["replay"]["recording"], "liver.mcap");
    assert_eq!((ended["reconstruction"].as_u64(), moved["reconstruction"].as_u64()), (Some(1), Some(2)));
    assert_eq!((ended["span_s"].as_f64(), moved["span_s"].as_f64()), (Some(0.19), Some(0.09)));
    assert!(ended["text"].as_str().unwrap().contains("recording has ended"), "{ended}");
    let (status, way) = server.download("/api/sessions/r/trajectory.tum").await;
    let stamps: Vec<_> = std::str::from_utf8(&way).unwrap().lines().skip(1).map(|line| &line[..11]).collect();
    assert_eq!((status, stamps.len(), stamps[0]), (200, 10, "0.100000005"));
    for nonsense in [json!({"rate": -1.0}), json!({"position_s": -1.0}), json!({"volume": 11})] {
        assert_eq!(control(nonsense).await.0, 400);
    }
    server.request("DELETE", "/api/sessions/r", None).await;
    let (_, files) = only_finished(&server).await;
    assert_eq!(files, ["trajectory.tum"]);
}

#[tokio::test]
async fn a_replay_keeps_the_recorded_pace() {
    let folder = TempDir::new().unwrap();
    let server = server_on(&folder.path().join("data")).await;
    std::fs::copy(recording(&folder), folder.path().join("data/recordings/liver.mcap")).unwrap();
    let started = std::time::Instant::now();
    replay(&server, json!({"session": "r", "replay": {"recording": "liver.mcap", "rate": 0.5}})).await;
    server.state_when("r", |state| state["replay"]["ended"] == true).await;
    // 19 intervals of 10 ms at half the pace; no upper bound, as the machine may be busy.
    assert!(started.elapsed() >= std::time::Duration::from_millis(380), "{:?}", started.elapsed());
}

#[tokio::test]
async fn uploads_that_cannot_be_replayed_are_not_kept() {
    let folder = TempDir::new().unwrap();
    let server = TestServer::start_with(|config| {
        config.storage.directory = folder.path().to_path_buf();
        config.storage.upload_max_mib = 1;
    })
    .await;
    let reason = |(status, answer): (u16, Value)| (status, answer["reason"].as_str().unwrap().to_owned());
    let noise = server.upload("/api/recordings/noise.mcap", vec![0x5A; 5000]).await;
    let told = noise.1["text"].as_str().unwrap();
    assert!(!told.contains(folder.path().to_str().unwrap()), "{told}");
    assert_eq!(reason(noise), (422, "invalid_recording".into()));
    let large = server.upload("/api/recordings/large.mcap", vec![0; (1 << 20) + 1]).await;
    assert_eq!(reason(large), (413, "oversized_message".into()));
    let odd = server.upload("/api/recordings/notes.txt", vec![1]).await;
    assert_eq!(reason(odd), (400, "malformed_message".into()));
    assert_eq!(server.request("GET", "/api/recordings", None).await.1, json!([]));
    assert_eq!(
        std::fs::read_dir(folder.path().join("recordings")).unwrap().count(),
        0,
        "nothing is left over"
    );
    let wanted = json!({"replay": {"recording": "noise.mcap"}});
    assert_eq!(
        reason(server.request("POST", "/api/sessions", Some(wanted)).await),
        (404, "unknown_recording".into())
    );
    open(&server, "live", false).await;
    let control = server.request("POST", "/api/sessions/live/replay", Some(json!({"paused": true}))).await;
    assert_eq!(reason(control), (409, "not_a_replay".into()));
}
