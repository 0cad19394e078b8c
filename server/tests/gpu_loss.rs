//! The GPU is lost in the middle of a session: poses go on, the model comes back from the journal.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::sync::Arc;
use std::time::Duration;

use gpu::Gpu;
use mis_slam::config::Config;
use mis_slam::session::gpu_engine::GpuEngine;
use protocol::v1::{self, to_server};
use recording::{Calibration, RecordingReader};
use serde_json::json;
use support::{TestServer, pose};
use tempfile::TempDir;

/// A tiny rigid liver as a recording.
fn liver(folder: &TempDir, config: &Config) -> RecordingReader {
    let path = folder.path().join("liver.mcap");
    let scene = simulator::SceneConfig {
        frames: 16,
        fps: 10.0,
        width_px: 320,
        height_px: 240,
        points: 10,
        ..mis_slam::simulated::rigid(&config.simulate)
    };
    let encoding = mis_slam::simulated::Encoding { jpeg_quality: 95, depth_every: 100 };
    mis_slam::simulated::record(&scene, &encoding, &path, &config.recording, &mut |_, _| {}).unwrap();
    RecordingReader::open(&path, &config.recording).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn poses_go_on_and_the_model_is_rebuilt_from_the_journal() {
    let folder = TempDir::new().unwrap();
    let mut config = Config::load(None, &["recording.flush_interval_ms=20".into()]).unwrap();
    config.storage.directory = folder.path().join("data");
    let reader = liver(&folder, &config);
    let Calibration::Rectified(rig) = reader.calibration().unwrap() else { panic!("a rectified rig") };
    let gpu = Arc::new(Gpu::open(&config.gpu.clone().with_environment()).unwrap());
    let engine = Arc::new(GpuEngine::new(Arc::clone(&gpu), &config));
    let directory = config.storage.directory.clone();
    let server = TestServer::start_on(engine, |service| {
        service.storage.directory = directory;
        service.recording.flush_interval_ms = 20;
    })
    .await;
    let left = mis_slam::convert::camera_to_wire(&rig.left);
    let wire =
        v1::RectifiedRig { left: Some(left), baseline_m: rig.baseline_m, right_cx_px: rig.right_cx_px };
    let calibration = v1::Calibration { rectified: Some(wire), raw: None };
    let body = json!({"session": "a", "calibration": calibration});
    let (status, opened) = server.request("POST", "/api/sessions", Some(body)).await;
    assert_eq!(status, 201, "{opened}");
    let mut cart = server.join("/api/sessions/a/ingest").await;
    let size_px = (rig.left.width_px, rig.left.height_px);
    let mut pairs = reader.stereo().unwrap().map(Result::unwrap).zip(0..);
    let mut feed = async |pairs: &mut dyn Iterator<Item = (recording::StereoMessage, u64)>| {
        for (message, sequence) in pairs {
            let fused = server.state("a").await["frames_fused"].clone();
            let pair = mis_slam::convert::pair_to_wire(message, sequence, size_px);
            cart.say(to_server::Body::Pair(pair)).await;
            cart.hear_until(|body| pose(body).filter(|pose| pose.sequence == sequence)).await;
            // Not passed over by the next one; while the model is rebuilt nothing is fused.
            let patience = std::time::Instant::now() + Duration::from_secs(3);
            while server.state("a").await["frames_fused"] == fused && std::time::Instant::now() < patience {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        }
    };
    feed(&mut pairs.by_ref().take(8)).await;
    let before = server.state_when("a", |state| state["surfels"].as_u64() > Some(50)).await;

    gpu.lose("a drill");
    feed(&mut pairs.by_ref().take(3)).await;
    let after =
        server.state_when("a", |state| state["model_stale"] == false && state["alarms"][0].is_string()).await;
    assert_eq!(after["status"], "live");
    assert!(after["alarms"][0].as_str().unwrap().contains("rebuilt"), "{after}");
    assert!(after["poses_published"].as_u64().unwrap() >= 11, "poses went on: {after}");
    let fused = after["frames_fused"].as_u64().unwrap();
    feed(&mut pairs).await;
    let at_end = server.state_when("a", |state| state["frames_fused"].as_u64() > Some(fused)).await;
    let (was, is) = (before["surfels"].as_u64().unwrap(), at_end["surfels"].as_u64().unwrap());
    assert!(is * 2 > was, "{is} surfels after the loss, {was} before");
}
