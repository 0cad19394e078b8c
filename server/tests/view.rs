//! Viewers on WebSocket connections against a real server.

mod support;

use protocol::limits;
use protocol::v1::{self, from_server, to_server};
use replica::Replica;
use support::{Client, TestServer, pose, wire_pair};

const INGEST: &str = "/api/sessions/a/ingest";
const VIEW: &str = "/api/sessions/a/view";

/// Sends pairs one by one, each after the pose of the one before.
async fn feed(cart: &mut Client, sequences: std::ops::Range<u64>) {
    for sequence in sequences {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
        assert_eq!(cart.hear_until(pose).await.sequence, sequence);
    }
}

#[tokio::test]
async fn viewers_that_join_early_and_late_hold_the_servers_model() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    let (mut early, mut late) = (Replica::default(), Replica::default());
    let mut first = server.join(VIEW).await;
    feed(&mut cart, 0..10).await;
    let mut second = server.join(VIEW).await;
    feed(&mut cart, 10..20).await;
    first.follow_model(&mut early, |model| model.surfels().len() == 20).await;
    second.follow_model(&mut late, |model| model.surfels().len() == 20).await;
    assert_eq!((early.surfels(), early.digest()), (late.surfels(), late.digest()));
    let state = server.state("a").await;
    assert_eq!((state["surfels"].as_u64(), state["viewers"].as_u64()), (Some(20), Some(2)));
    assert_eq!(state["epoch"], early.epoch());
}

#[tokio::test]
async fn a_viewer_hears_state_model_and_pose_in_one_stream() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    feed(&mut cart, 0..1).await;
    let mut viewer = server.join(VIEW).await;
    let (mut state, mut model, mut newest_pose) = (None, None, None);
    while state.is_none() || model.is_none() || newest_pose.is_none() {
        match viewer.hear().await {
            from_server::Body::State(heard) => state = Some(heard),
            from_server::Body::Snapshot(heard) => model = Some(heard),
            from_server::Body::Pose(heard) => newest_pose = Some(heard),
            _ => {}
        }
    }
    assert_eq!(state.unwrap().session, "a");
    assert!(newest_pose.unwrap().world_from_camera.is_some());
    assert_eq!(model.unwrap().surfels_total, 1);
}

#[tokio::test]
async fn features_go_to_the_viewer_that_asks_for_them() {
    let server = TestServer::start().await;
    server.open("a").await;
    let hub = std::sync::Arc::clone(server.registry.find("a").unwrap().hub());
    let mut curious = server.join(VIEW).await;
    let mut other = server.join(VIEW).await;
    curious.say(to_server::Body::View(v1::View { features: true, ..v1::View::default() })).await;
    let sent = v1::ImageFeatures { stamp_ns: 7, matched: vec![40, 80], ..v1::ImageFeatures::default() };
    support::within(async {
        while hub.features.receiver_count() == 0 {
            tokio::task::yield_now().await;
        }
    })
    .await;
    hub.publish_features(sent.clone());
    let features = |body| if let from_server::Body::Features(heard) = body { Some(heard) } else { None };
    assert_eq!(curious.hear_until(features).await, sent);
    hub.publish_preview(7, support::jpeg(support::SIZE_PX));
    let next = |body| match body {
        from_server::Body::Features(_) => Some("features"),
        from_server::Body::Preview(_) => Some("preview"),
        _ => None,
    };
    assert_eq!(other.hear_until(next).await, "preview");
}

#[tokio::test]
async fn a_viewer_that_asks_is_seeded_anew() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    feed(&mut cart, 0..5).await;
    let mut viewer = server.join(VIEW).await;
    let mut model = Replica::default();
    viewer.follow_model(&mut model, |model| model.surfels().len() == 5).await;
    viewer.say(to_server::Body::Resync(v1::Resync { held_epoch: 2 })).await;
    let mut again = Replica::default();
    viewer.follow_model(&mut again, |model| model.surfels().len() == 5).await;
    assert_eq!(again.surfels(), model.surfels());
}

#[tokio::test]
async fn a_closed_session_says_farewell() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut viewer = server.join(VIEW).await;
    let mut cart = server.join(INGEST).await;
    assert_eq!(server.request("DELETE", "/api/sessions/a", None).await.0, 204);
    for client in [&mut viewer, &mut cart] {
        let (last_words, code) = client.hear_close().await;
        let Some(from_server::Body::Farewell(farewell)) = last_words else { panic!("{last_words:?}") };
        assert_eq!((farewell.text.as_str(), code), ("closed by request", limits::CLOSE_GOING_AWAY));
        assert!(farewell.r#final);
    }
}

#[tokio::test]
async fn a_lost_source_is_told_to_viewers() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    let mut viewer = server.join(VIEW).await;
    feed(&mut cart, 0..3).await;
    drop(cart);
    let lost = |body| match body {
        from_server::Body::State(state) if state.status() == v1::SessionStatus::SourceLost => Some(state),
        _ => None,
    };
    let state = viewer.hear_until(lost).await;
    assert!(!state.source_present);
}

#[tokio::test]
async fn a_viewer_may_not_talk_out_of_turn_or_at_length() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut impostor = server.join(VIEW).await;
    let empty = v1::StereoPair::default();
    impostor.say(to_server::Body::Pair(empty)).await;
    assert_eq!(impostor.hear_close().await.1, limits::CLOSE_REFUSED);
    let mut shouter = server.join(VIEW).await;
    shouter.say(to_server::Body::Hello(protocol::hello(&"x".repeat(8 << 10)))).await;
    assert_eq!(shouter.hear_close().await.1, limits::CLOSE_OVERSIZED);
}

#[tokio::test]
async fn a_stopping_server_tells_everybody_and_ends() {
    let mut server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join(INGEST).await;
    let mut viewer = server.join(VIEW).await;
    feed(&mut cart, 0..2).await;
    server.stop();
    for client in [&mut viewer, &mut cart] {
        let (last_words, code) = client.hear_close().await;
        let Some(from_server::Body::Farewell(farewell)) = last_words else { panic!("{last_words:?}") };
        assert_eq!((farewell.text.as_str(), code), ("the server is shutting down", limits::CLOSE_GOING_AWAY));
        assert!(!farewell.r#final);
    }
    drop((cart, viewer));
    assert!(server.registry.is_draining());
    server.ended().await.unwrap();
}

fn note(text: &str) -> to_server::Body {
    let annotation = v1::Annotation { surfel_id: 3, text: text.to_owned(), ..v1::Annotation::default() };
    let change = v1::shared_change::Change::Annotate(annotation);
    to_server::Body::SharedChange(v1::SharedChange { change: Some(change) })
}

fn shared(body: from_server::Body) -> Option<v1::SharedScene> {
    if let from_server::Body::Shared(scene) = body { Some(scene) } else { None }
}

#[tokio::test]
async fn a_note_reaches_viewers_that_are_there_and_those_that_come_later() {
    let server = TestServer::start().await;
    server.open("a").await;
    let (mut writer, mut reader) = (server.join(VIEW).await, server.join(VIEW).await);
    writer.say(note("polyp")).await;
    let mut late = server.join(VIEW).await;
    for viewer in [&mut writer, &mut reader, &mut late] {
        let scene = viewer.hear_until(shared).await;
        assert_eq!((scene.annotations[0].id, scene.annotations[0].text.as_str()), (1, "polyp"));
    }
}

#[tokio::test]
async fn a_note_without_text_is_refused_and_the_stream_goes_on() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut viewer = server.join(VIEW).await;
    viewer.say(note("")).await;
    let refused = |body| if let from_server::Body::Refusal(refusal) = body { Some(refusal) } else { None };
    let refusal = viewer.hear_until(refused).await;
    assert_eq!(refusal.reason(), v1::Reason::InvalidChange);
    assert!(refusal.text.contains("text has 0 characters"), "{}", refusal.text);
    viewer.say(note("vessel")).await;
    assert_eq!(viewer.hear_until(shared).await.annotations.len(), 1);
}
