//! `mis-slam-cart` as a library against a real server, over both transports.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::path::PathBuf;

use geometry::{Pinhole, Rgb, StereoRig};
use mis_slam_cart::{CartConfig, CartError, Encoding, Endpoint, PublishOptions, publish_recording};
use protocol::v1::Reason;
use recording::{Calibration, RecordingWriter};
use support::{SIZE_PX, TestServer};
use tempfile::TempDir;

const PAIRS: u64 = 20;

fn config() -> CartConfig {
    CartConfig::load(None, &["cart.give_up_s=0.5".into(), "cart.retry_first_s=0.05".into()])
        .expect("the defaults are complete")
}

/// A recording of 20 pairs at 100 Hz.
fn recording(folder: &TempDir, baseline_m: f64) -> PathBuf {
    let path = folder.path().join("rec.mcap");
    let (width_px, height_px) = SIZE_PX;
    let left = Pinhole { width_px, height_px, fx_px: 60.0, fy_px: 60.0, cx_px: 32.0, cy_px: 24.0 };
    let rig = StereoRig { left, baseline_m, right_cx_px: 32.0 };
    let mut writer = RecordingWriter::create(&path, &config().recording).unwrap();
    writer.write_calibration(0, &Calibration::Rectified(rig)).unwrap();
    for number in 0..PAIRS {
        let picture = Rgb::from_fn(width_px, height_px, |x, y| [(x * 3) as u8, (y * 5) as u8, number as u8]);
        let image = recording::encode_jpeg(&picture, 80).unwrap();
        writer.write_pair(1 + number * 10_000_000, &image, &image).unwrap();
    }
    writer.finish().unwrap();
    path
}

fn options(recording: PathBuf, to: &str, session: Option<&str>) -> PublishOptions {
    PublishOptions {
        source: recording,
        rig_file: None,
        encoding: Encoding::Jpeg { quality: 90 },
        to: to.parse().unwrap(),
        session: session.map(|id| id.parse().unwrap()),
        takeover_token: None,
        rate: 1.0,
        repeat: false,
    }
}

async fn publish(options: &PublishOptions) -> Result<mis_slam_cart::PublishReport, CartError> {
    support::within(publish_recording(options, &config(), |_| {}, std::future::pending())).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_is_streamed_over_a_websocket() {
    let (server, folder) = (TestServer::start().await, TempDir::new().unwrap());
    let to = format!("ws://{}", server.address);
    let report = publish(&options(recording(&folder, 0.005), &to, None)).await.unwrap();
    assert_eq!(report.sent + report.skipped, PAIRS);
    assert!(report.poses > 0 && report.latency.is_some(), "{report:?}");
    assert!(report.refused.is_empty(), "{report:?}");
    let state = server.state_when(&report.session, |state| state["status"] == "source_lost").await;
    assert_eq!(state["pairs_received"], report.sent);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_is_streamed_over_zenoh() {
    let server = TestServer::start_with(|config| config.zenoh.enabled = true).await;
    let folder = TempDir::new().unwrap();
    let to = format!("zenoh/{}", server.zenoh_endpoints[0]);
    let report = publish(&options(recording(&folder, 0.005), &to, Some("theatre-3"))).await.unwrap();
    assert_eq!((report.session.as_str(), report.sent + report.skipped), ("theatre-3", PAIRS));
    assert!(report.poses > 0, "{report:?}");
    server.state_when("theatre-3", |state| state["source_present"] == false).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_open_session_is_joined_and_what_starts_over_goes_on() {
    let (server, folder) = (TestServer::start().await, TempDir::new().unwrap());
    let to = format!("ws://{}", server.address);
    let looped =
        PublishOptions { repeat: true, ..options(recording(&folder, 0.005), &to, Some("theatre-3")) };
    server.open("theatre-3").await;
    let long_enough = async {
        server.state_when("theatre-3", |state| state["pairs_received"].as_u64() > Some(PAIRS + 5)).await;
    };
    let report = support::within(publish_recording(&looped, &config(), |_| {}, long_enough)).await.unwrap();
    assert!(report.sent > PAIRS, "{report:?}");
    assert!(report.refused.is_empty(), "{report:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_refuses_ends_the_stream_with_its_reason() {
    let server = TestServer::start_with(|config| config.rig.baseline_max_mm = 4.0).await;
    let folder = TempDir::new().unwrap();
    let to = format!("ws://{}", server.address);
    let refused = publish(&options(recording(&folder, 0.005), &to, None)).await.unwrap_err();
    assert!(matches!(refused, CartError::Refused { reason: Reason::InvalidCalibration, .. }), "{refused}");
    assert!(!refused.is_bad_input());
}

#[tokio::test(flavor = "multi_thread")]
async fn pairs_over_the_servers_limit_end_the_stream_with_its_reason() {
    let server = TestServer::start_with(|config| config.server.message_max_mib = 0.001).await;
    let folder = TempDir::new().unwrap();
    let to = format!("ws://{}", server.address);
    let refused = publish(&options(recording(&folder, 0.005), &to, None)).await.unwrap_err();
    assert!(matches!(refused, CartError::Refused { reason: Reason::OversizedMessage, .. }), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_is_away_is_given_up_and_a_missing_recording_is_bad_input() {
    let folder = TempDir::new().unwrap();
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let away =
        publish(&options(recording(&folder, 0.005), &format!("ws://{nobody}"), None)).await.unwrap_err();
    assert!(matches!(away, CartError::Unreachable { .. }), "{away}");
    let to: Endpoint = format!("ws://{nobody}").parse().unwrap();
    let missing =
        publish(&options(folder.path().join("none.mcap"), &to.to_string(), None)).await.unwrap_err();
    assert!(missing.is_bad_input());
}

#[tokio::test(flavor = "multi_thread")]
async fn cameras_and_images_that_make_no_sense_are_told_before_anything_is_sent() {
    let folder = TempDir::new().unwrap();
    let nobody = "ws://127.0.0.1:9";
    let wide = publish(&options(recording(&folder, 0.5), nobody, None)).await.unwrap_err();
    assert!(wide.is_bad_input() && wide.to_string().contains("baseline"), "{wide}");

    let images = folder.path().join("images");
    let rig = "image_width_px = 64";
    for eye in ["left", "right"] {
        std::fs::create_dir_all(images.join(eye)).unwrap();
        std::fs::write(images.join(eye).join("0001.png"), b"no image").unwrap();
    }
    std::fs::write(images.join("rig.toml"), rig).unwrap();
    let nonsense = publish(&options(images, nobody, None)).await.unwrap_err();
    assert!(nonsense.is_bad_input(), "{nonsense}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_of_images_is_streamed_as_jpeg() {
    let (server, folder) = (TestServer::start().await, TempDir::new().unwrap());
    let images = folder.path().join("images");
    for eye in ["left", "right"] {
        std::fs::create_dir_all(images.join(eye)).unwrap();
        for number in 0..5 {
            let picture = Rgb::from_fn(SIZE_PX.0, SIZE_PX.1, |x, y| [x as u8, y as u8, number * 20]);
            let png = recording::encode_png_rgb(&picture).unwrap().bytes;
            std::fs::write(images.join(eye).join(format!("{number:04}.png")), png).unwrap();
        }
    }
    std::fs::write(images.join("rig.toml"), RIG).unwrap();
    let report = publish(&options(images, &format!("ws://{}", server.address), None)).await.unwrap();
    assert_eq!((report.sent + report.skipped, report.refused.len()), (5, 0), "{report:?}");
}

/// A rig file of the folder.
const RIG: &str = include_str!("support/rig.toml");

#[tokio::test(flavor = "multi_thread")]
async fn a_second_cart_takes_over_with_the_token_only() {
    let (server, folder) = (TestServer::start().await, TempDir::new().unwrap());
    let to = format!("ws://{}", server.address);
    let recording = recording(&folder, 0.005);
    let looped = PublishOptions { repeat: true, ..options(recording.clone(), &to, Some("theatre-3")) };
    let first = tokio::spawn(async move { publish(&looped).await });
    server.state_when_open("theatre-3", |state| state["pairs_received"].as_u64() > Some(3)).await;
    let again = options(recording, &to, Some("theatre-3"));
    let refused = publish(&again).await.unwrap_err();
    assert!(matches!(refused, CartError::Refused { reason: Reason::SessionBusy, .. }), "{refused}");
    let session = server.registry.find("theatre-3").unwrap();
    let takeover_token = Some(session.hub().takeover_token().to_owned());
    publish(&PublishOptions { takeover_token, ..again }).await.unwrap();
    let ended = support::within(first).await.unwrap().unwrap_err();
    assert!(matches!(ended, CartError::Refused { reason: Reason::TakenOver, .. }), "{ended}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_is_closed_on_purpose_is_not_opened_again() {
    let server = TestServer::start_with(|config| config.zenoh.enabled = true).await;
    let folder = TempDir::new().unwrap();
    let recording = recording(&folder, 0.005);
    let to = [format!("ws://{}", server.address), format!("zenoh/{}", server.zenoh_endpoints[0])];
    for (to, session) in to.iter().zip(["theatre-3", "theatre-4"]) {
        let looped = PublishOptions { repeat: true, ..options(recording.clone(), to, Some(session)) };
        let streaming = tokio::spawn(async move { publish(&looped).await });
        server.state_when_open(session, |state| state["pairs_received"].as_u64() > Some(3)).await;
        let closed = server.request("DELETE", &format!("/api/sessions/{session}"), None).await;
        assert_eq!(closed.0, 204);
        let ended = support::within(streaming).await.unwrap().unwrap_err();
        assert!(
            matches!(&ended, CartError::SessionClosed { text } if text == "closed by request"),
            "{ended}"
        );
        assert_eq!(server.request("GET", &format!("/api/sessions/{session}"), None).await.0, 404);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_comes_back_is_found_again() {
    let folder = TempDir::new().unwrap();
    let mut server = TestServer::start().await;
    let address = server.address;
    let looped = PublishOptions {
        repeat: true,
        ..options(recording(&folder, 0.005), &format!("ws://{address}"), Some("theatre-3"))
    };
    let patient = CartConfig::load(None, &["cart.retry_first_s=0.05".into()]).unwrap();
    let story = async {
        server.state_when_open("theatre-3", |state| state["pairs_received"].as_u64() > Some(3)).await;
        server.stop();
        server.ended().await.unwrap();
        let again = TestServer::start_with(|config| config.server.listen = address).await;
        again.state_when_open("theatre-3", |state| state["pairs_received"].as_u64() > Some(3)).await;
    };
    let report = support::within(publish_recording(&looped, &patient, |_| {}, story)).await.unwrap();
    assert_eq!(report.reconnects, 1);
}
