//! Carts on WebSocket connections, good and bad ones, against a real server.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use protocol::v1::{self, Reason, from_server, to_server};
use support::{SIZE_PX, TestServer, calibration, jpeg, pose, wire_pair, within};
use tokio_tungstenite::tungstenite::Message;

fn ingest(id: &str) -> String {
    format!("/api/sessions/{id}/ingest")
}

#[tokio::test]
async fn a_cart_gets_a_pose_for_its_pair() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    cart.say(to_server::Body::Pair(wire_pair(7))).await;
    let pose = cart.hear_until(pose).await;
    assert_eq!((pose.sequence, pose.outcome()), (7, v1::TrackingOutcome::Tracked));
    assert_eq!(pose.stamp_ns, wire_pair(7).stamp_ns);
    let state = server.state_when("a", |state| state["surfels"] == 1).await;
    assert_eq!((state["status"].as_str(), state["source_present"].as_bool()), (Some("live"), Some(true)));
}

#[tokio::test]
async fn an_oversized_message_ends_the_connection_with_1009() {
    let server = TestServer::start_with(|config| config.server.message_max_mib = 0.01).await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    let bytes = vec![0; 11 << 10];
    futures_util::SinkExt::send(&mut cart.socket, Message::Binary(bytes.into())).await.unwrap();
    let (last_words, code) = cart.hear_close().await;
    assert_eq!(code, 1009);
    let Some(from_server::Body::Refusal(refusal)) = last_words else { panic!("{last_words:?}") };
    assert_eq!(refusal.reason(), Reason::OversizedMessage);
    assert!(refusal.text.contains("10485 bytes"), "{}", refusal.text);
}

#[tokio::test]
async fn images_of_another_size_are_refused_with_both_sizes() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    let admitted_to = v1::StereoPair { left: Some(jpeg((96, 48))), ..wire_pair(1) };
    cart.say(to_server::Body::Pair(admitted_to)).await;
    let refusal = cart.hear_refusal().await;
    assert_eq!((refusal.reason(), refusal.sequence), (Reason::ImageSizeMismatch, Some(1)));
    assert_eq!(refusal.text, "left image: expected 64x48, got 96x48");

    let lying = v1::EncodedImage { width_px: 64, ..jpeg((4000, 48)) };
    cart.say(to_server::Body::Pair(v1::StereoPair { right: Some(lying), ..wire_pair(2) })).await;
    let refusal = cart.hear_refusal().await;
    assert_eq!((refusal.reason(), refusal.sequence), (Reason::ImageSizeMismatch, Some(2)));
    assert!(refusal.text.contains("64x48") && refusal.text.contains("4000x48"), "{}", refusal.text);
}

#[tokio::test]
async fn garbage_is_counted_and_tracking_goes_on() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    let garbage = v1::EncodedImage { data: vec![0x5A; 300].into(), ..jpeg(SIZE_PX) };
    cart.say(to_server::Body::Pair(v1::StereoPair { left: Some(garbage), ..wire_pair(1) })).await;
    assert_eq!(cart.hear_refusal().await.reason(), Reason::MalformedImage);
    let whole = jpeg(SIZE_PX);
    let truncated = v1::EncodedImage { data: whole.data.slice(..whole.data.len() / 2), ..whole };
    cart.say(to_server::Body::Pair(v1::StereoPair { right: Some(truncated), ..wire_pair(2) })).await;
    assert_eq!(cart.hear_refusal().await.reason(), Reason::MalformedImage);
    cart.say(to_server::Body::Pair(v1::StereoPair { right: None, ..wire_pair(3) })).await;
    assert_eq!(cart.hear_refusal().await.reason(), Reason::Unpaired);
    cart.say(to_server::Body::Pair(wire_pair(4))).await;
    assert_eq!(cart.hear_until(pose).await.sequence, 4);
    let state = server.state("a").await;
    assert_eq!(state["drops"], serde_json::json!({"malformed_image": 2, "unpaired": 1}));
    assert_eq!(state["pairs_received"], 4);
}

#[tokio::test]
async fn stamps_that_do_not_go_forward_are_refused() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    cart.say(to_server::Body::Pair(wire_pair(5))).await;
    for (sequence, reason) in
        [(5, Reason::DuplicateStamp), (4, Reason::StaleStamp), (10_000, Reason::FutureStamp)]
    {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
        assert_eq!(cart.hear_refusal().await.reason(), reason);
    }
}

#[tokio::test]
async fn many_bad_pairs_degrade_the_session() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    for sequence in 0..8 {
        cart.say(to_server::Body::Pair(v1::StereoPair { left: None, ..wire_pair(sequence) })).await;
    }
    let status = |body| {
        if let from_server::Body::State(state) = body { Some(state.status()) } else { None }
    };
    let degraded = |body| status(body).filter(|status| *status == v1::SessionStatus::Degraded);
    cart.hear_until(degraded).await;
}

#[tokio::test]
async fn a_second_cart_is_refused_with_409_while_the_first_is_there() {
    let server = TestServer::start().await;
    server.open("a").await;
    let first = server.join(&ingest("a")).await;
    assert_eq!(server.refused_upgrade(&ingest("a")).await, 409);
    drop(first);
    server.state_when("a", |state| state["source_present"] == false).await;
    server.join(&ingest("a")).await;
}

#[tokio::test]
async fn a_cart_that_vanishes_is_a_lost_source_and_the_model_stays() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    cart.say(to_server::Body::Pair(wire_pair(1))).await;
    cart.hear_until(pose).await;
    // No close frame: the process was killed.
    drop(cart);
    let state = server.state_when("a", |state| state["status"] == "source_lost").await;
    assert_eq!(state["surfels"], 1);
}

#[tokio::test]
async fn another_calibration_is_taken_and_the_model_starts_anew() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    cart.say(to_server::Body::Pair(wire_pair(1))).await;
    cart.hear_until(pose).await;
    cart.say(to_server::Body::Calibration(calibration(SIZE_PX))).await;
    cart.say(to_server::Body::Calibration(calibration((96, 48)))).await;
    let resized = |sequence| v1::StereoPair {
        left: Some(jpeg((96, 48))),
        right: Some(jpeg((96, 48))),
        ..wire_pair(sequence)
    };
    cart.say(to_server::Body::Pair(resized(2))).await;
    assert_eq!(cart.hear_until(pose).await.sequence, 2);
    server.state_when("a", |state| state["surfels"] == 1 && state["epoch"] == 3).await;
}

#[tokio::test]
async fn a_calibration_that_is_not_believed_changes_nothing() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    let mut wide = calibration(SIZE_PX);
    wide.rectified.as_mut().unwrap().baseline_m = 0.5;
    cart.say(to_server::Body::Calibration(wide)).await;
    assert_eq!(cart.hear_refusal().await.reason(), Reason::InvalidCalibration);
    cart.say(to_server::Body::Pair(wire_pair(1))).await;
    assert_eq!(cart.hear_until(pose).await.sequence, 1);
}

#[tokio::test]
async fn peers_that_do_not_speak_the_protocol_are_told_so() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut from_the_future = server.connect(&ingest("a")).await;
    let hello = v1::Hello {
        oldest_version: 90,
        newest_version: 99,
        software: "future".into(),
        ..v1::Hello::default()
    };
    from_the_future.say(to_server::Body::Hello(hello)).await;
    let (last_words, code) = from_the_future.hear_close().await;
    let reason = last_words.and_then(support::refusal).map(|refusal| refusal.reason());
    assert_eq!((reason, code), (Some(Reason::UnsupportedVersion), 1008));
    server.state_when("a", |state| state["source_present"] == false).await;

    let mut rude = server.connect(&ingest("a")).await;
    rude.say(to_server::Body::Pair(wire_pair(1))).await;
    assert_eq!(rude.hear_close().await.1, 1008);
    server.state_when("a", |state| state["source_present"] == false).await;

    let mut chatty = server.connect(&ingest("a")).await;
    futures_util::SinkExt::send(&mut chatty.socket, Message::Text("hello".into())).await.unwrap();
    assert_eq!(chatty.hear_close().await.1, 1007);
}

#[tokio::test]
async fn unknown_and_impossible_sessions_are_not_found() {
    let server = TestServer::start().await;
    assert_eq!(server.refused_upgrade(&ingest("nobody")).await, 404);
    assert_eq!(server.refused_upgrade("/api/sessions/nobody/view").await, 404);
    assert_eq!(server.refused_upgrade(&ingest("no.body")).await, 400);
    let (status, body) = server.request("GET", "/api/sessions/nobody", None).await;
    assert_eq!((status, body["reason"].as_str()), (404, Some("unknown_session")));
}

#[tokio::test]
async fn a_cart_never_waits_for_a_slow_reconstruction() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(&ingest("a")).await;
    for sequence in 0..100 {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
    }
    let state = server.state_when("a", |state| state["pairs_received"] == 100).await;
    assert_eq!(state["status"], "live");
    // Every pair is either answered by a pose or counted as overtaken.
    let accounted = |state: &serde_json::Value| {
        let superseded = state["drops"]["superseded"].as_u64().unwrap_or_default();
        state["poses_published"].as_u64().unwrap() + superseded == 100
    };
    within(server.state_when("a", accounted)).await;
}
