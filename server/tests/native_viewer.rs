//! The native viewer's feed against a real server, over both transports.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod support;

use std::time::{Duration, Instant};

use mis_slam_view::{Feed, FeedOptions, Scene};
use protocol::Endpoint;
use protocol::v1::to_server;
use support::{Client, TestServer, pose, wire_pair};

const INGEST: &str = "/api/sessions/a/ingest";
/// Nothing here takes so long unless it never ends.
const DEADLINE: Duration = Duration::from_secs(60);

async fn feed(cart: &mut Client, sequences: std::ops::Range<u64>) {
    for sequence in sequences {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
        assert_eq!(cart.hear_until(pose).await.sequence, sequence);
    }
}

fn follow(to: &str) -> Feed {
    let to: Endpoint = to.parse().unwrap();
    let options = FeedOptions { to, session: "a".parse().unwrap(), token: None };
    Feed::start(options, || ()).unwrap()
}

async fn until(feed: &Feed, wanted: impl Fn(&Scene) -> bool) -> Scene {
    let started = Instant::now();
    loop {
        let scene = feed.scene();
        if wanted(&scene) {
            return scene;
        }
        assert!(started.elapsed() < DEADLINE, "gave up: {scene:?}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

fn holds(surfels: usize) -> impl Fn(&Scene) -> bool {
    move |scene| scene.is_current && scene.surfels.len() == surfels
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_follows_the_model_over_websocket_and_zenoh() {
    let server = TestServer::start_with(|config| config.zenoh.enabled = true).await;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    feed(&mut cart, 0..5).await;
    let by_socket = follow(&format!("ws://{}", server.address));
    let by_zenoh = follow(&format!("zenoh/{}", server.zenoh_endpoints[0]));
    for viewer in [&by_socket, &by_zenoh] {
        until(viewer, holds(5)).await;
    }
    feed(&mut cart, 5..9).await;
    for viewer in [&by_socket, &by_zenoh] {
        let scene = until(viewer, holds(9)).await;
        let place_m = scene.surfels[8].position_in_world_m;
        let off_m = place_m.iter().zip([0.009, 0.0, 0.1]).map(|(found, sent): (_, f32)| (found - sent).abs());
        // The wire rounds to steps of 0.02 mm.
        assert!(off_m.fold(0.0, f32::max) < 1.1e-5, "{place_m:?}");
        let known = until(viewer, |scene| scene.world_from_scope.is_some() && scene.connected).await;
        assert_eq!((known.resyncs, known.notice.as_str()), (0, ""));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_comes_back_by_itself_when_the_server_does() {
    let mut server = TestServer::start().await;
    let address = server.address;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    feed(&mut cart, 0..4).await;
    let viewer = follow(&format!("ws://{address}"));
    until(&viewer, holds(4)).await;
    server.stop();
    server.ended().await.unwrap();
    let lost = until(&viewer, |scene| !scene.connected).await;
    assert_eq!(lost.surfels.len(), 4, "what is held is still shown");

    let again = TestServer::start_with(|config| config.server.listen = address).await;
    until(&viewer, |scene| scene.unknown_session).await;
    again.open("a").await;
    let mut cart = again.join(INGEST).await;
    feed(&mut cart, 0..2).await;
    let back = until(&viewer, holds(2)).await;
    assert!(back.connected && !back.unknown_session);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_does_not_exist_is_said_to_be_unknown() {
    let server = TestServer::start_with(|config| config.zenoh.enabled = true).await;
    for to in [format!("ws://{}", server.address), format!("zenoh/{}", server.zenoh_endpoints[0])] {
        let scene = until(&follow(&to), |scene| scene.unknown_session).await;
        assert!(!scene.is_current && !scene.notice.is_empty(), "{to}: {scene:?}");
    }
}
