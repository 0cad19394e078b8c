//! A deforming model streamed by a real server over real `WebSockets` and real zenoh, to real replicas.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use mis_slam::publish::model_lane::{ModelUpdate, NodeChanges};
use mis_slam::session::engine::{Engine, EngineError, EngineResults, EngineStart, RunningEngine};
use mis_slam::session::hub::Hub;
use mis_slam::session::mailbox::{MailboxReceiver, Taken};
use mis_slam::session::worker::StereoPair;
use protocol::keys::Lane;
use protocol::v1::{from_server, to_server};
use protocol::{NodePosition, NodeTransform, WireSurfel};
use replica::Replica;
use support::{Client, TestServer, decode, pose, publish_pose, wire_pair, within};
use zenoh::query::ConsolidationMode;

/// Surfels that the first pair brings.
const SURFELS: u32 = 4000;
/// Every pair moves everything so far along y: 250 steps of 4 micrometres.
const MOVED_M: f32 = 1e-3;

/// Each pair is an epoch: the first brings surfels and nodes, every other one moves them and sends one surfel anew.
struct DeformingEngine;

struct DeformingThread(JoinHandle<()>);

impl Engine for DeformingEngine {
    fn start(
        &self,
        _: &EngineStart,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError> {
        let work = move || {
            let mut held = Replica::from_the_start();
            loop {
                match pairs.take_within(Duration::from_millis(5)) {
                    Taken::Value(pair) => publish(&hub, &pair, &mut held),
                    Taken::Nothing | Taken::Woken => bring_shapes(&hub, &held),
                    Taken::Closed => return,
                }
            }
        };
        Ok(Box::new(DeformingThread(std::thread::spawn(work))))
    }
}

impl RunningEngine for DeformingThread {
    fn join(self: Box<Self>) -> Option<EngineResults> {
        self.0.join().unwrap();
        None
    }
}

fn surfel(id: u32, moved_m: f32) -> WireSurfel {
    WireSurfel {
        id,
        position_in_world_m: [4e-4 * (id % 64) as f32, 4e-4 * (id / 64) as f32 + moved_m, 0.1],
        normal_in_world: [0.0, 0.0, -1.0],
        radius_m: 3e-4,
        color: [180, 90, 80],
        confidence: 1.0,
    }
}

fn publish(hub: &Hub, pair: &StereoPair, held: &mut Replica) {
    let step = held.epoch();
    let update = if step == 0 {
        let nodes =
            (0..16).map(|id| (id, NodePosition::pack([6e-3 * (id % 4) as f32, 6e-3 * (id / 4) as f32, 0.1])));
        ModelUpdate {
            stamp_ns: pair.stamp_ns,
            changed: (0..SURFELS).map(|id| surfel(id, 0.0)).collect(),
            nodes: NodeChanges { added: nodes.collect(), reach_m: 0.1, ..NodeChanges::default() },
            ..ModelUpdate::default()
        }
    } else {
        let transforms = vec![NodeTransform([0, 250, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]); 16];
        ModelUpdate {
            stamp_ns: pair.stamp_ns,
            changed: vec![surfel(step % SURFELS, step as f32 * MOVED_M)],
            nodes: NodeChanges { transforms, reach_m: 0.1, ..NodeChanges::default() },
            ..ModelUpdate::default()
        }
    };
    let published = hub.model.publish(&update).unwrap();
    let message = protocol::decode_from_server(published.message).unwrap().body.unwrap();
    let from_server::Body::Epoch(epoch) = message else { panic!("{message:?}") };
    held.take_epoch(&epoch).unwrap();
    bring_shapes(hub, held);
    publish_pose(hub, pair);
}

fn bring_shapes(hub: &Hub, held: &Replica) {
    if hub.model.wants_shapes() {
        let rows = held.surfels().ids().iter().zip(held.surfels().rows());
        let shapes = rows.map(|(&id, row)| WireSurfel {
            position_in_world_m: row.position_in_world_m,
            normal_in_world: row.normal_in_world,
            ..surfel(id, 0.0)
        });
        hub.model.bring_shapes(shapes.collect());
    }
}

async fn feed(cart: &mut Client, sequences: std::ops::Range<u64>) {
    for sequence in sequences {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
        while cart.hear_until(pose).await.sequence != sequence {}
    }
}

/// Every surfel is where `epochs` epochs have moved it to, within the rounding of one snapshot.
fn assert_in_place(viewer: &Replica, epochs: u32) {
    assert_eq!((viewer.epoch(), viewer.surfels().len()), (epochs, SURFELS as usize));
    for (&id, row) in viewer.surfels().ids().iter().zip(viewer.surfels().rows()) {
        let expected = surfel(id, (epochs - 1) as f32 * MOVED_M).position_in_world_m;
        let off = row.position_in_world_m.iter().zip(expected).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f32::max) < 2.2e-5, "surfel {id}: {row:?}, expected {expected:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sixteen_viewers_that_join_early_and_late_hold_the_deformed_model() {
    let server = TestServer::start_on(Arc::new(DeformingEngine), |_| {}).await;
    server.open("a").await;
    let mut cart = server.join("/api/sessions/a/ingest").await;
    let mut viewers = Vec::new();
    for number in 0..16 {
        viewers.push((server.join("/api/sessions/a/view").await, Replica::default()));
        feed(&mut cart, number..number + 1).await;
    }
    for (client, replica) in &mut viewers {
        client.follow_model(replica, |model| model.is_current() && model.epoch() == 16).await;
        assert_in_place(replica, 16);
    }
    assert!(viewers.windows(2).all(|pair| pair[0].1.digest() == pair[1].1.digest()));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_that_reads_late_catches_up_and_the_others_miss_nothing() {
    let patient = |config: &mut mis_slam::service::ServiceConfig| config.publish.viewer_lag_s = 60.0;
    let server = TestServer::start_on(Arc::new(DeformingEngine), patient).await;
    server.open("a").await;
    let mut cart = server.join("/api/sessions/a/ingest").await;
    feed(&mut cart, 0..1).await;
    let mut quick = server.join("/api/sessions/a/view").await;
    let mut followed = Replica::default();
    quick.follow_model(&mut followed, Replica::is_current).await;
    for sequence in 1..60 {
        feed(&mut cart, sequence..sequence + 1).await;
        let epoch = sequence as u32 + 1;
        quick.follow_model(&mut followed, |model| model.epoch() == epoch).await;
        assert!(followed.is_current(), "never seeded anew");
    }
    let mut idle = server.join("/api/sessions/a/view").await;
    feed(&mut cart, 60..160).await;
    let mut late = Replica::default();
    idle.follow_model(&mut late, |model| model.is_current() && model.epoch() == 160).await;
    assert_in_place(&late, 160);
}

#[tokio::test(flavor = "multi_thread")]
async fn two_sessions_do_not_mix() {
    let server = TestServer::start_on(Arc::new(DeformingEngine), |_| {}).await;
    let mut epochs = Vec::new();
    for (session, pairs) in [("a", 3), ("b", 7)] {
        server.open(session).await;
        let mut cart = server.join(&format!("/api/sessions/{session}/ingest")).await;
        feed(&mut cart, 0..pairs).await;
        epochs.push((session, pairs as u32));
    }
    for (session, epochs) in epochs {
        let mut client = server.join(&format!("/api/sessions/{session}/view")).await;
        let mut viewer = Replica::default();
        client.follow_model(&mut viewer, |model| model.is_current() && model.epoch() == epochs).await;
        assert_in_place(&viewer, epochs);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_epoch_is_noticed_over_zenoh_and_mended_by_a_snapshot() {
    let server = TestServer::start_on(Arc::new(DeformingEngine), |config| config.zenoh.enabled = true).await;
    server.open("z").await;
    let mut cart = server.join("/api/sessions/z/ingest").await;
    feed(&mut cart, 0..3).await;
    let peer = server.zenoh_client().await;
    let session = "z".parse().unwrap();
    let epochs = peer.declare_subscriber(Lane::ModelEpoch.key(&session)).await.unwrap();
    let mut viewer = Replica::default();
    snapshot(&peer, &mut viewer).await;
    assert_in_place(&viewer, 3);
    let mut sequence = 3;
    let mut noticed = false;
    while viewer.epoch() < 10 {
        feed(&mut cart, sequence..sequence + 1).await;
        sequence += 1;
        let Ok(Ok(sample)) = tokio::time::timeout(Duration::from_millis(200), epochs.recv_async()).await
        else {
            continue;
        };
        let from_server::Body::Epoch(epoch) = decode(sample.payload()) else { panic!("no epoch") };
        // The network loses the fourth that comes.
        if epoch.epoch != 7 && viewer.take_epoch(&epoch).is_err() {
            noticed = true;
            snapshot(&peer, &mut viewer).await;
        }
    }
    assert!(noticed);
    let epoch = viewer.epoch();
    assert_in_place(&viewer, epoch);
}

async fn snapshot(peer: &zenoh::Session, viewer: &mut Replica) {
    let key = Lane::ModelSnapshot.key(&"z".parse().unwrap());
    let chunks = peer.get(key).consolidation(ConsolidationMode::None).await.unwrap();
    viewer.forget();
    while !viewer.is_current() {
        let reply = within(chunks.recv_async()).await.expect("more chunks");
        let from_server::Body::Snapshot(chunk) = decode(reply.result().unwrap().payload()) else {
            panic!("no chunk")
        };
        viewer.take_chunk(&chunk).unwrap();
    }
}
