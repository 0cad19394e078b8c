//! The lane as viewers see it; their side is the real replica.

use std::time::Duration;

use protocol::v1::from_server;
use protocol::{NodePosition, NodeTransform, WireSurfel};
use replica::Replica;

use super::*;

const LIMITS: LagLimits = LagLimits { bytes: 1 << 20, age: Duration::from_secs(3600) };

fn surfel(id: u32, x_m: f32) -> WireSurfel {
    WireSurfel {
        id,
        position_in_world_m: [x_m, 0.0, 0.1],
        normal_in_world: [0.0, 0.0, -1.0],
        radius_m: 0.001,
        color: [180, 90, 80],
        confidence: 1.0,
    }
}

fn update(changed: impl IntoIterator<Item = u32>, removed: &[u32]) -> ModelUpdate {
    let changed = changed.into_iter().map(|id| surfel(id, id as f32 * 1e-3)).collect();
    ModelUpdate { stamp_ns: 1, changed, removed: removed.to_vec(), ..ModelUpdate::default() }
}

fn nodes_come() -> ModelUpdate {
    let added = vec![(1, NodePosition::default()), (2, NodePosition([1000, 0, 0]))];
    let nodes = NodeChanges { added, reach_m: 1.0, ..NodeChanges::default() };
    ModelUpdate { nodes, ..ModelUpdate::default() }
}

/// Moves everything by 1 mm along y.
fn warp() -> ModelUpdate {
    let transform = NodeTransform([0, 250, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let nodes = NodeChanges { transforms: vec![transform; 2], reach_m: 1.0, ..NodeChanges::default() };
    ModelUpdate { nodes, ..ModelUpdate::default() }
}

/// Takes in what waits, until the viewer stands at `epoch`; how many messages that took.
async fn follow(subscription: &ModelSubscription, viewer: &mut Replica, epoch: u32) -> usize {
    let mut messages = 0;
    while !(viewer.is_current() && viewer.epoch() == epoch) {
        let next = tokio::time::timeout(Duration::from_secs(20), subscription.next());
        let bytes = next.await.expect("a message in time").expect("the lane is open");
        messages += 1;
        match protocol::decode_from_server(bytes).unwrap().body.unwrap() {
            from_server::Body::Snapshot(chunk) => drop(viewer.take_chunk(&chunk).unwrap()),
            from_server::Body::Epoch(epoch) => drop(viewer.take_epoch(&epoch).unwrap()),
            other => panic!("{other:?} on the model lane"),
        }
    }
    messages
}

#[tokio::test]
async fn viewers_that_join_at_any_time_hold_the_same_model() {
    let lane = ModelLane::new(LIMITS);
    let early = lane.subscribe(Seed::Snapshot);
    lane.publish(&update([1, 2, 3], &[])).unwrap();
    let late = lane.subscribe(Seed::Snapshot);
    lane.publish(&update([2, 4], &[1])).unwrap();
    let (mut first, mut second) = (Replica::default(), Replica::default());
    follow(&early, &mut first, 2).await;
    follow(&late, &mut second, 2).await;
    assert_eq!(first.surfels().ids(), [2, 3, 4]);
    assert_eq!(first.surfels(), second.surfels());
    assert_eq!(lane.extent(), (2, 3));
}

#[tokio::test]
async fn all_viewers_are_sent_the_same_bytes() {
    let lane = ModelLane::new(LIMITS);
    let viewers: Vec<_> = (0..64).map(|_| lane.subscribe(Seed::Snapshot)).collect();
    for viewer in &viewers {
        follow(viewer, &mut Replica::default(), 0).await;
    }
    let sent = lane.publish(&update([1], &[])).unwrap();
    for viewer in &viewers {
        assert_eq!(viewer.next().await.unwrap().as_ptr(), sent.message.as_ptr());
    }
}

#[tokio::test]
async fn a_viewer_over_its_budget_is_seeded_anew_and_others_do_not_notice() {
    let lane = ModelLane::new(LagLimits { bytes: 2000, ..LIMITS });
    let (slow, quick) = (lane.subscribe(Seed::Snapshot), lane.subscribe(Seed::Snapshot));
    let (mut slow_viewer, mut quick_viewer) = (Replica::default(), Replica::default());
    follow(&slow, &mut slow_viewer, 0).await;
    let mut quick_messages = follow(&quick, &mut quick_viewer, 0).await;
    for epoch in 1..=40 {
        lane.publish(&update(0..20, &[])).unwrap();
        quick_messages += follow(&quick, &mut quick_viewer, epoch).await;
    }
    assert_eq!(quick_messages, 41);
    assert!(follow(&slow, &mut slow_viewer, 40).await < 20);
    assert_eq!(slow_viewer.surfels(), quick_viewer.surfels());
}

#[tokio::test]
async fn a_viewer_whose_epochs_grow_old_is_seeded_with_fewer_surfels() {
    let lane = ModelLane::new(LagLimits { age: Duration::ZERO, ..LIMITS });
    lane.publish(&update(0..4000, &[])).unwrap();
    let slow = lane.subscribe(Seed::Snapshot);
    let mut viewer = Replica::default();
    follow(&slow, &mut viewer, 1).await;
    // It takes nothing for a while, so little was sent in the time since.
    tokio::time::sleep(Duration::from_millis(1500)).await;
    lane.publish(&update(0..4000, &[])).unwrap();
    tokio::time::sleep(Duration::from_millis(2)).await;
    lane.publish(&update(0..10, &[])).unwrap();
    let mut viewer = Replica::default();
    follow(&slow, &mut viewer, 3).await;
    let held = viewer.surfels().len();
    assert!((500..4000).contains(&held), "{held} surfels");
}

#[tokio::test]
async fn a_viewer_that_asks_is_seeded_anew() {
    let lane = ModelLane::new(LIMITS);
    lane.publish(&update([1, 2], &[])).unwrap();
    let viewer = lane.subscribe(Seed::Snapshot);
    follow(&viewer, &mut Replica::default(), 1).await;
    viewer.resync();
    let mut again = Replica::default();
    follow(&viewer, &mut again, 1).await;
    assert_eq!(again.surfels().ids(), [1, 2]);
}

#[tokio::test]
async fn who_joins_a_deformed_model_waits_for_its_shapes_and_loses_no_epoch() {
    let lane = ModelLane::new(LIMITS);
    lane.publish(&ModelUpdate { nodes: nodes_come().nodes, ..update([1, 2], &[]) }).unwrap();
    lane.publish(&warp()).unwrap();
    assert!(!lane.wants_shapes(), "nobody is there");

    let late = lane.subscribe(Seed::Snapshot);
    let waits = tokio::time::timeout(Duration::from_millis(20), late.next()).await;
    assert!(waits.is_err() && lane.wants_shapes());
    let moved =
        |id: u32| WireSurfel { position_in_world_m: [id as f32 * 1e-3, 0.001, 0.1], ..surfel(id, 0.0) };
    lane.bring_shapes(vec![moved(1), moved(2)]);
    assert!(!lane.wants_shapes());
    lane.publish(&warp()).unwrap();
    let mut viewer = Replica::default();
    follow(&late, &mut viewer, 3).await;
    for (id, row) in viewer.surfels().ids().iter().zip(viewer.surfels().rows()) {
        let expected = [*id as f32 * 1e-3, 0.002, 0.1];
        let pairs = row.position_in_world_m.into_iter().zip(expected);
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1.1e-5), "{row:?}");
    }
    let next = lane.subscribe(Seed::Snapshot);
    let mut second = Replica::default();
    follow(&next, &mut second, 3).await;
    assert_eq!(second.surfels(), viewer.surfels(), "the same snapshot and the epochs since");
}

#[tokio::test]
async fn a_viewer_that_takes_few_surfels_gets_those_it_looks_at_and_a_digest_of_its_own() {
    let lane = ModelLane::new(LIMITS);
    lane.publish(&update(0..1000, &[])).unwrap();
    let small = lane.subscribe(Seed::Snapshot);
    let gaze_in_world_m = Some([0.9, 0.0, 0.1]);
    small.set_wishes(ViewerWishes { gaze_in_world_m, surfels_max: Some(100), ..ViewerWishes::default() });
    let mut viewer = Replica::default();
    follow(&small, &mut viewer, 1).await;
    let held = viewer.surfels().ids().to_vec();
    assert!((70..130).contains(&held.len()), "{} surfels", held.len());
    assert!((880..920).all(|id| held.contains(&id)), "{held:?}");
    lane.publish(&update([0, 500, 900, 1000], &[880, 881, 1])).unwrap();
    follow(&small, &mut viewer, 2).await;
    assert!(!viewer.surfels().ids().contains(&880));
}

#[tokio::test]
async fn a_viewer_that_asks_for_a_pace_gets_it() {
    let lane = ModelLane::new(LIMITS);
    let paced = lane.subscribe(Seed::Snapshot);
    paced.set_wishes(ViewerWishes { bytes_per_s_max: Some(20_000), ..ViewerWishes::default() });
    let mut viewer = Replica::default();
    follow(&paced, &mut viewer, 0).await;
    let begin = Instant::now();
    let mut bytes = 0;
    for _ in 0..10 {
        bytes += lane.publish(&update(0..20, &[])).unwrap().message.len();
    }
    follow(&paced, &mut viewer, 10).await;
    let least = Duration::from_secs_f64((bytes as f64 * 0.8) / 20_000.0);
    assert!(begin.elapsed() >= least, "{bytes} bytes in {:?}", begin.elapsed());
}

#[tokio::test]
async fn chunks_come_nearest_to_the_scope_first() {
    let lane = ModelLane::new(LIMITS);
    lane.publish(&update(0..10_000, &[])).unwrap();
    lane.set_scope([7.0, 0.0, 0.1]);
    let chunks = lane.subscribe(Seed::Whole).whole().await.unwrap();
    let nearest_m =
        chunks.iter().map(|bytes| match protocol::decode_from_server(bytes.clone()).unwrap().body.unwrap() {
            from_server::Body::Snapshot(chunk) => {
                let surfels = chunk.surfels.map(|block| protocol::unpack_surfels(&block).unwrap());
                let off = |surfel: &WireSurfel| (surfel.position_in_world_m[0] - 7.0).abs();
                surfels.map_or(0.0, |block| block.iter().map(off).fold(f32::MAX, f32::min))
            }
            other => panic!("{other:?} in a snapshot"),
        });
    let nearest_m: Vec<f32> = nearest_m.collect();
    assert_eq!(nearest_m.len(), 5);
    assert!(nearest_m.is_sorted(), "{nearest_m:?}");
}

#[tokio::test]
async fn surfels_without_a_packed_form_are_left_out_until_they_have_one() {
    let lane = ModelLane::new(LIMITS);
    let far = |x_m| ModelUpdate { changed: vec![surfel(1, 0.0), surfel(2, x_m)], ..ModelUpdate::default() };
    let sent = lane.publish(&far(f32::NAN)).unwrap();
    assert_eq!((sent.surfels, sent.unpackable), (1, 1));
    assert_eq!(lane.publish(&far(0.5)).unwrap().surfels, 2);
    assert_eq!(lane.publish(&far(99.0)).unwrap().surfels, 1);
    assert_eq!(lane.publish(&update([], &[2])).unwrap().surfels, 1);
}

#[tokio::test]
async fn a_cleared_model_is_empty_and_goes_on_from_the_same_epochs() {
    let lane = ModelLane::new(LIMITS);
    let subscription = lane.subscribe(Seed::Snapshot);
    lane.publish(&ModelUpdate { nodes: nodes_come().nodes, ..update([1, 2], &[]) }).unwrap();
    lane.clear().unwrap();
    lane.publish(&update([1], &[])).unwrap();
    let mut viewer = Replica::default();
    follow(&subscription, &mut viewer, 3).await;
    assert_eq!((viewer.surfels().ids(), viewer.nodes().len()), (&[1][..], 0));
}

#[tokio::test]
async fn a_closed_lane_ends_after_what_waits() {
    let lane = ModelLane::new(LIMITS);
    let viewer = lane.subscribe(Seed::Nothing);
    lane.publish(&update([1], &[])).unwrap();
    lane.close();
    assert!(viewer.next().await.is_some());
    assert_eq!(viewer.next().await, None);
}
