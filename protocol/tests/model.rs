//! The model on both sides: snapshot and epochs lead to the same surfels, and nothing else is accepted.

use proptest::prelude::*;
use protocol::limits::SNAPSHOT_CHUNK_SURFELS;
use protocol::v1::{ModelEpoch, SnapshotChunk};
use protocol::{PackedModel, ProtocolError, SnapshotAssembly, WireSurfel, pack_ids, pack_surfels};

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

fn changes(model: &PackedModel, removed: &[u32], added: &[u32], updated: &[u32]) -> ModelEpoch {
    let block = |ids: &[u32], x_m| {
        let surfels: Vec<_> = ids.iter().map(|&id| surfel(id, x_m)).collect();
        pack_surfels(&surfels).expect("all of them have a packed form")
    };
    let epoch = model.epoch() + 1;
    ModelEpoch {
        epoch,
        base_epoch: model.epoch(),
        stamp_ns: u64::from(epoch) * 33_000_000,
        removed_ids: pack_ids(removed),
        added: Some(block(added, 0.0)),
        updated: Some(block(updated, epoch as f32 * 1e-3)),
        ..ModelEpoch::default()
    }
}

fn seeded(chunks: &[SnapshotChunk]) -> PackedModel {
    let mut assembly = SnapshotAssembly::default();
    let mut models = chunks.iter().filter_map(|chunk| assembly.push(chunk).expect("chunks in order"));
    models.next().expect("the last chunk completes the model")
}

#[test]
fn a_viewer_that_follows_epochs_holds_what_the_server_holds() {
    let (mut server, mut viewer) = (PackedModel::default(), PackedModel::default());
    for (removed, added, updated) in
        [(&[][..], &[3, 5, 9][..], &[][..]), (&[5], &[1, 4, 12], &[9]), (&[1, 12], &[], &[3, 4])]
    {
        let epoch = server.advance(changes(&server, removed, added, updated)).unwrap();
        assert_eq!(epoch.surfels as usize, server.len());
        viewer.apply(&epoch).unwrap();
        assert_eq!(viewer, server);
    }
    assert_eq!(server.ids(), [3, 4, 9]);
}

#[test]
fn a_late_joiner_holds_what_those_before_it_hold() {
    let mut server = PackedModel::default();
    let many: Vec<u32> = (0..2 * SNAPSHOT_CHUNK_SURFELS as u32 + 10).collect();
    server.advance(changes(&server, &[], &many, &[])).unwrap();
    server.advance(changes(&server, &[0], &[], &[7, 9])).unwrap();

    let chunks = server.snapshot();
    assert_eq!(chunks.len(), 3);
    let mut late = seeded(&chunks);
    assert_eq!(late, server);
    let next = server.advance(changes(&server, &[9], &[], &[7])).unwrap();
    late.apply(&next).unwrap();
    assert_eq!(late, server);
}

#[test]
fn an_empty_model_is_one_empty_chunk() {
    let chunks = PackedModel::default().snapshot();
    assert_eq!(chunks.len(), 1);
    assert!(seeded(&chunks).is_empty());
}

#[test]
fn a_cleared_model_is_empty_for_viewers_too() {
    let mut server = PackedModel::default();
    server.advance(changes(&server, &[], &[1, 2], &[])).unwrap();
    let mut viewer = seeded(&server.snapshot());
    let clearing = server.advance(server.clearing()).unwrap();
    viewer.apply(&clearing).unwrap();
    assert!(viewer.is_empty() && server.is_empty());
}

#[test]
fn epochs_that_do_not_fit_leave_the_model_as_it_was() {
    let mut model = PackedModel::default();
    model.advance(changes(&model, &[], &[1, 2], &[])).unwrap();
    let before = model.clone();
    let base = ModelEpoch { base_epoch: 7, ..changes(&model, &[], &[], &[]) };
    assert_eq!(model.apply(&base), Err(ProtocolError::WrongBase { held: 1, base: 7 }));
    for (removed, added, updated, error) in [
        (&[3][..], &[][..], &[][..], ProtocolError::NotHeld { id: 3 }),
        (&[], &[2], &[], ProtocolError::AlreadyHeld { id: 2 }),
        (&[], &[], &[0], ProtocolError::NotHeld { id: 0 }),
        (&[1], &[], &[1], ProtocolError::NotHeld { id: 1 }),
    ] {
        assert_eq!(model.apply(&changes(&model, removed, added, updated)), Err(error));
    }
    let wrong_digest = changes(&model, &[1], &[], &[]);
    assert!(matches!(model.apply(&wrong_digest), Err(ProtocolError::DigestMismatch { epoch: 2, .. })));
    assert_eq!(model, before);
}

#[test]
fn a_snapshot_with_a_lost_chunk_is_refused_and_can_start_anew() {
    let mut server = PackedModel::default();
    let many: Vec<u32> = (0..3 * SNAPSHOT_CHUNK_SURFELS as u32).collect();
    server.advance(changes(&server, &[], &many, &[])).unwrap();
    let chunks = server.snapshot();
    let mut assembly = SnapshotAssembly::default();
    assembly.push(&chunks[0]).unwrap();
    assert_eq!(assembly.push(&chunks[2]), Err(ProtocolError::MissingChunk { expected: 1, got: 2 }));
    let models: Vec<_> = chunks.iter().filter_map(|chunk| assembly.push(chunk).unwrap()).collect();
    assert_eq!(models, [server]);
}

proptest! {
    #[test]
    fn any_history_leads_viewers_to_the_same_model(
        steps in prop::collection::vec(prop::collection::btree_map(0_u32..60, 0_u8..3, 0..40), 1..12),
        joins_at in 0_usize..12,
    ) {
        let mut server = PackedModel::default();
        let mut viewer = None;
        for (index, step) in steps.into_iter().enumerate() {
            if index == joins_at {
                viewer = Some(seeded(&server.snapshot()));
            }
            let (held, new): (Vec<_>, Vec<_>) = step.into_iter().partition(|(id, _)| server.holds(*id));
            let ids = |of: &[(u32, u8)], remove: bool| -> Vec<u32> {
                of.iter().filter(|(_, action)| (*action == 0) == remove).map(|(id, _)| *id).collect()
            };
            let new: Vec<u32> = new.into_iter().map(|(id, _)| id).collect();
            let epoch = changes(&server, &ids(&held, true), &new, &ids(&held, false));
            let epoch = server.advance(epoch).unwrap();
            if let Some(viewer) = &mut viewer {
                viewer.apply(&epoch).unwrap();
                prop_assert_eq!(&*viewer, &server);
            }
        }
    }
}
