//! What a replica accepts, what it refuses, and how it comes back.
#![expect(clippy::unwrap_used, reason = "a test ends at what it does not expect")]

mod support;

use protocol::v1::{ModelEpoch, SnapshotChunk};
use protocol::{NodeTransform, ProtocolError, pack_ids, pack_transforms};
use replica::{Progress, Replica, ReplicaError};
use support::Lane;

/// A server three epochs into a session, and a replica that has followed it.
fn server_and_replica() -> (Lane, Replica) {
    let (mut lane, mut replica) = (Lane::default(), Replica::from_the_start());
    for step in 0..3 {
        replica.take_epoch(&lane.advance(step)).unwrap();
    }
    (lane, replica)
}

fn snapshot(lane: &Lane) -> Vec<SnapshotChunk> {
    lane.model.snapshot().unwrap().into_iter().map(|placed| placed.chunk).collect()
}

#[test]
fn a_follower_is_the_servers_equal_at_every_epoch() {
    let (mut lane, mut replica) = server_and_replica();
    for step in 3..8 {
        assert_eq!(replica.take_epoch(&lane.advance(step)), Ok(Progress::Current));
        assert_eq!(replica.digest(), lane.model.digest());
        assert_eq!(replica.surfels().ids(), lane.model.surfels().ids());
    }
}

#[test]
fn identity_transforms_and_rigid_motion_do_what_they_should() {
    let (mut lane, mut replica) = server_and_replica();
    let before = replica.surfels().rows().to_vec();
    let mut move_all = |transform: NodeTransform| {
        let transforms = vec![transform; lane.model.nodes().len()];
        let epoch = ModelEpoch { node_transforms: pack_transforms(&transforms), ..lane.still() };
        replica.take_epoch(&lane.model.advance(epoch).unwrap()).unwrap();
        replica.surfels().rows().to_vec()
    };
    assert_eq!(move_all(NodeTransform::default()), before);
    let shifted = move_all(NodeTransform([250, -500, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]));
    for (after, before) in shifted.iter().zip(&before) {
        let expected = [0.001, -0.002, 0.0];
        for ((after, before), moved) in
            after.position_in_world_m.iter().zip(before.position_in_world_m).zip(expected)
        {
            assert!((after - before - moved).abs() < 3e-8, "{after} {before} {moved}");
        }
        assert!(after.normal_in_world.iter().zip(before.normal_in_world).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}

#[test]
fn a_single_lost_epoch_is_noticed_and_a_snapshot_mends_it() {
    let (mut lane, mut replica) = server_and_replica();
    let lost = lane.advance(3);
    let next = lane.advance(4);
    let held = replica.surfels().clone();
    let wrong_base = ProtocolError::WrongBase { held: lost.base_epoch, base: lost.epoch };
    assert_eq!(replica.take_epoch(&next), Err(wrong_base.into()));
    assert!(!replica.is_current());
    assert_eq!(replica.surfels(), &held, "the last good model is still shown");
    for chunk in snapshot(&lane) {
        replica.take_chunk(&chunk).unwrap();
    }
    assert!(replica.is_current());
    assert_eq!(replica.digest(), lane.model.digest());
}

#[test]
fn a_lost_epoch_whose_number_was_forged_is_caught_by_the_digest() {
    let (mut lane, mut replica) = server_and_replica();
    let lost = lane.advance(4);
    let next = ModelEpoch { base_epoch: lost.base_epoch, ..lane.advance(6) };
    let refused = replica.take_epoch(&next).unwrap_err();
    assert!(matches!(refused, ReplicaError::Digest { .. }), "{refused}");
}

#[test]
fn an_epoch_that_does_not_fit_changes_nothing() {
    let (lane, replica) = server_and_replica();
    let broken = [
        ModelEpoch { removed_ids: pack_ids(&[900]).unwrap(), ..lane.still() },
        ModelEpoch { removed_node_ids: pack_ids(&[900]).unwrap(), ..lane.still() },
        ModelEpoch { node_transforms: pack_transforms(&[NodeTransform::default()]), ..lane.still() },
        ModelEpoch { digest: 1, ..lane.still() },
    ];
    for epoch in broken {
        let mut victim = replica.clone();
        assert!(victim.take_epoch(&epoch).is_err());
        assert!(!victim.is_current());
        assert_eq!((victim.surfels(), victim.epoch()), (replica.surfels(), replica.epoch()));
    }
}

#[test]
fn chunks_may_come_in_any_order_twice_and_before_their_epochs() {
    let (mut lane, _) = server_and_replica();
    let mut late = Replica::default();
    let chunks = snapshot(&lane);
    let next = lane.advance(3);
    assert_eq!(late.take_chunk(&chunks[1]), Ok(Progress::Seeding));
    assert_eq!(late.take_chunk(&chunks[1]), Ok(Progress::Seeding));
    assert_eq!(late.arriving().count(), 64);
    assert_eq!(late.take_epoch(&next), Ok(Progress::Kept));
    assert_eq!(late.take_chunk(&chunks[0]), Ok(Progress::Current));
    assert_eq!((late.epoch(), late.digest()), (next.epoch, lane.model.digest()));
}

#[test]
fn a_new_snapshot_starts_over_and_old_epochs_are_passed_by() {
    let (mut lane, _) = server_and_replica();
    let mut late = Replica::default();
    let old = snapshot(&lane);
    let passed = lane.advance(3);
    late.take_chunk(&old[0]).unwrap();
    for chunk in snapshot(&lane) {
        late.take_chunk(&chunk).unwrap();
    }
    assert_eq!(late.digest(), lane.model.digest());
    assert_eq!(late.take_epoch(&passed), Ok(Progress::Kept));
}

#[test]
fn a_snapshot_with_another_digest_or_an_impossible_chunk_is_refused() {
    let (lane, mut replica) = server_and_replica();
    let chunks = snapshot(&lane);
    let wrong = |chunk: &SnapshotChunk| SnapshotChunk { digest: 1, ..chunk.clone() };
    replica.take_chunk(&wrong(&chunks[0])).unwrap();
    let refused = replica.take_chunk(&wrong(&chunks[1])).unwrap_err();
    assert!(matches!(refused, ReplicaError::Digest { .. }), "{refused}");
    let beyond = SnapshotChunk { index: 2, ..chunks[1].clone() };
    let refused = replica.take_chunk(&beyond).unwrap_err();
    assert_eq!(refused, ProtocolError::ChunkIndex { index: 2, count: 2 }.into());
    assert_eq!(replica.surfels().ids(), lane.model.surfels().ids());
}
