//! Carts and viewers on zenoh against a real server.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::time::Duration;

use protocol::SessionId;
use protocol::keys::{self, Lane};
use protocol::v1::{self, Reason, from_server, to_server};
use replica::Replica;
use support::{SIZE_PX, TestServer, calibration, decode, pose, wire_pair, within};
use zenoh::handlers::FifoChannelHandler;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::ConsolidationMode;
use zenoh::sample::Sample;

async fn server() -> TestServer {
    TestServer::start_with(|config| config.zenoh.enabled = true).await
}

struct Peer {
    session: zenoh::Session,
    name: SessionId,
}

type Samples = Subscriber<FifoChannelHandler<Sample>>;

fn id(text: &str) -> SessionId {
    text.parse().unwrap()
}

impl Peer {
    async fn connect(server: &TestServer, name: &str) -> Self {
        Self { session: server.zenoh_client().await, name: id(name) }
    }

    async fn token(&self) -> LivelinessToken {
        self.session.liveliness().declare_token(keys::source_token(&id("z"), &self.name)).await.unwrap()
    }

    async fn subscribe(&self, key: &str) -> Samples {
        self.session.declare_subscriber(key.to_owned()).await.unwrap()
    }

    async fn ask(&self, key: &str, body: to_server::Body) -> from_server::Body {
        let answers = self
            .session
            .get(key)
            .payload(protocol::to_server(body, Some(&self.name)))
            .timeout(Duration::from_secs(30))
            .await
            .unwrap();
        let answer = answers.recv_async().await.expect("an answer");
        let payload =
            answer.result().map_or_else(|error| error.payload().clone(), |sample| sample.payload().clone());
        decode(&payload)
    }

    async fn calibrate(&self) -> from_server::Body {
        self.ask(&Lane::IngestCalibration.key(&id("z")), to_server::Body::Calibration(calibration(SIZE_PX)))
            .await
    }

    async fn put(&self, sequence: u64) {
        let bytes = protocol::to_server(to_server::Body::Pair(wire_pair(sequence)), Some(&self.name));
        self.session.put(Lane::IngestStereo.key(&id("z")), bytes).await.unwrap();
    }
}

async fn next(samples: &Samples) -> from_server::Body {
    decode(within(samples.recv_async()).await.unwrap().payload())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cart_opens_a_session_by_its_calibration_and_gets_poses() {
    let server = server().await;
    let cart = Peer::connect(&server, "cart").await;
    let _token = cart.token().await;
    let poses = cart.subscribe(&Lane::Pose.key(&id("z"))).await;
    let hello = cart.ask(&Lane::Control.key(&id("z")), to_server::Body::Hello(protocol::hello("test"))).await;
    assert!(matches!(hello, from_server::Body::Hello(_)), "{hello:?}");
    let answer = cart.calibrate().await;
    assert!(matches!(answer, from_server::Body::Hello(_)), "{answer:?}");
    // Sent until one comes back: the server's publisher is matched a moment after the session opens.
    let mut sequence = 0;
    let pose = loop {
        cart.put(sequence).await;
        sequence += 1;
        if let Ok(Ok(sample)) = tokio::time::timeout(Duration::from_millis(100), poses.recv_async()).await {
            break pose(decode(sample.payload())).unwrap();
        }
    };
    assert_eq!(pose.outcome(), v1::TrackingOutcome::Tracked);
    assert_eq!(server.state("z").await["status"], "live");
}

#[tokio::test(flavor = "multi_thread")]
async fn snapshot_and_epochs_are_the_servers_model() {
    let server = server().await;
    let cart = Peer::connect(&server, "cart").await;
    cart.calibrate().await;
    for sequence in 0..5 {
        cart.put(sequence).await;
        let poses = sequence + 1;
        server.state_when("z", |state| state["poses_published"] == poses).await;
    }
    let viewer = Peer::connect(&server, "viewer").await;
    let epochs = viewer.subscribe(&Lane::ModelEpoch.key(&id("z"))).await;
    let mut model = Replica::default();
    snapshot(&viewer, &mut model).await;
    assert_eq!(model.surfels().len(), 5);
    let mut sequence = 5;
    while model.surfels().len() < 8 {
        cart.put(sequence).await;
        sequence += 1;
        let Ok(Ok(sample)) = tokio::time::timeout(Duration::from_millis(100), epochs.recv_async()).await
        else {
            continue;
        };
        let from_server::Body::Epoch(epoch) = decode(sample.payload()) else { panic!("not an epoch") };
        if model.take_epoch(&epoch).is_err() {
            snapshot(&viewer, &mut model).await;
        }
    }
}

async fn snapshot(viewer: &Peer, model: &mut Replica) {
    let chunks = viewer
        .session
        .get(Lane::ModelSnapshot.key(&id("z")))
        .consolidation(ConsolidationMode::None)
        .await
        .unwrap();
    while !model.is_current() {
        let reply = within(chunks.recv_async()).await.expect("more chunks");
        let from_server::Body::Snapshot(chunk) = decode(reply.result().unwrap().payload()) else {
            panic!("not a chunk")
        };
        model.take_chunk(&chunk).unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cart_that_is_killed_is_a_lost_source() {
    let server = server().await;
    let cart = Peer::connect(&server, "cart").await;
    let _token = cart.token().await;
    cart.calibrate().await;
    cart.put(0).await;
    server.state_when("z", |state| state["status"] == "live").await;
    // The transport ends without a word to the session, as when the process is killed.
    cart.session.close().await.unwrap();
    let state = server.state_when("z", |state| state["source_present"] == false).await;
    assert_eq!(state["status"], "source_lost");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_cart_is_refused_and_hears_why() {
    let server = server().await;
    let first = Peer::connect(&server, "first").await;
    let second = Peer::connect(&server, "second").await;
    first.calibrate().await;
    let from_server::Body::Refusal(refusal) = second.calibrate().await else { panic!("not refused") };
    assert_eq!(refusal.reason(), Reason::SessionBusy);
    let replies = second.subscribe(&keys::reply(&id("z"), &id("second"))).await;
    let refused = async {
        loop {
            first.put(0).await;
            second.put(1).await;
            if let Ok(sample) = tokio::time::timeout(Duration::from_millis(100), replies.recv_async()).await {
                return decode(sample.unwrap().payload());
            }
        }
    };
    let from_server::Body::Refusal(refusal) = within(refused).await else { panic!("not refused") };
    assert_eq!((refusal.reason(), refusal.sequence), (Reason::SessionBusy, Some(1)));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_refused_is_refused_with_a_reason() {
    let server = server().await;
    let peer = Peer::connect(&server, "cart").await;
    let mut broken = calibration(SIZE_PX);
    broken.rectified.as_mut().unwrap().baseline_m = f64::NAN;
    let key = Lane::IngestCalibration.key(&id("z"));
    let misplaced = to_server::Body::Hello(protocol::hello("test"));
    let future =
        to_server::Body::Hello(v1::Hello { oldest_version: 9, newest_version: 9, ..v1::Hello::default() });
    for (key, body, reason) in [
        (key.clone(), to_server::Body::Calibration(broken), Reason::InvalidCalibration),
        (key, misplaced.clone(), Reason::MalformedMessage),
        (Lane::Control.key(&id("z")), future, Reason::UnsupportedVersion),
        (Lane::ModelSnapshot.key(&id("z")), misplaced, Reason::UnknownSession),
    ] {
        let from_server::Body::Refusal(refusal) = peer.ask(&key, body).await else { panic!("not refused") };
        assert_eq!(refusal.reason(), reason, "{key}");
    }
    // Garbage has no sender to answer; the server goes on.
    peer.session.put(Lane::IngestStereo.key(&id("z")), vec![0xFF; 64]).await.unwrap();
    assert!(matches!(peer.calibrate().await, from_server::Body::Hello(_)));
}

#[tokio::test(flavor = "multi_thread")]
async fn carts_on_both_transports_feed_their_sessions_at_once() {
    let server = server().await;
    let on_zenoh = Peer::connect(&server, "cart").await;
    on_zenoh.calibrate().await;
    server.open("w").await;
    let mut on_websocket = server.join("/api/sessions/w/ingest").await;
    for sequence in 0..4 {
        on_zenoh.put(sequence).await;
        on_websocket.say(to_server::Body::Pair(wire_pair(sequence))).await;
        on_websocket.hear_until(pose).await;
    }
    for session in ["z", "w"] {
        server
            .state_when(session, |state| state["status"] == "live" && state["surfels"].as_u64() > Some(0))
            .await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn viewers_on_zenoh_hear_the_farewell() {
    let server = server().await;
    let cart = Peer::connect(&server, "cart").await;
    let control = cart.subscribe(&Lane::Control.key(&id("z"))).await;
    cart.calibrate().await;
    let publishing = cart.subscribe(&Lane::State.key(&id("z"))).await;
    next(&publishing).await;
    server.request("DELETE", "/api/sessions/z", None).await;
    let from_server::Body::Farewell(farewell) = next(&control).await else { panic!("no farewell") };
    assert_eq!(farewell.text, "closed by request");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_note_asked_for_over_zenoh_is_answered_by_all_that_is_shared() {
    let server = server().await;
    let peer = Peer::connect(&server, "headset").await;
    peer.calibrate().await;
    let note = |text: &str| {
        let annotation = v1::Annotation { text: text.to_owned(), ..v1::Annotation::default() };
        let change = v1::shared_change::Change::Annotate(annotation);
        to_server::Body::SharedChange(v1::SharedChange { change: Some(change) })
    };
    let control = Lane::Control.key(&id("z"));
    let from_server::Body::Shared(scene) = peer.ask(&control, note("polyp")).await else {
        panic!("not all that is shared")
    };
    assert_eq!(scene.annotations.len(), 1);
    let from_server::Body::Refusal(refusal) = peer.ask(&control, note("")).await else {
        panic!("no refusal")
    };
    assert_eq!(refusal.reason(), Reason::InvalidChange);
    let unknown = peer.ask(&Lane::Control.key(&id("nobody")), note("polyp")).await;
    let from_server::Body::Refusal(refusal) = unknown else { panic!("no refusal") };
    assert_eq!(refusal.reason(), Reason::UnknownSession);
}
