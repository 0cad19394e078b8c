//! The server's account of the model: what it accepts, what a snapshot of it holds.
#![expect(clippy::unwrap_used, reason = "a test ends at what it does not expect")]

use protocol::limits::SNAPSHOT_CHUNK_SURFELS;
use protocol::v1::{ModelEpoch, PackedNodes};
use protocol::{
    ChunkContents, NodePosition, NodeTransform, PackedModel, ProtocolError, WireSurfel, pack_ids, pack_nodes,
    pack_surfels, pack_transforms,
};

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
        removed_ids: pack_ids(removed).unwrap(),
        added: Some(block(added, 0.0)),
        updated: Some(block(updated, epoch as f32 * 1e-3)),
        node_reach_m: 0.008,
        ..ModelEpoch::default()
    }
}

fn nodes(ids: &[u32]) -> Option<PackedNodes> {
    let positions = vec![NodePosition([100, -200, 300]); ids.len()];
    Some(pack_nodes(ids, &positions).unwrap())
}

fn with_surfels_and_nodes() -> PackedModel {
    let mut model = PackedModel::default();
    let epoch = ModelEpoch { added_nodes: nodes(&[7, 8]), ..changes(&model, &[], &[3, 5, 9], &[]) };
    model.advance(epoch).unwrap();
    model
}

#[test]
fn an_accepted_epoch_is_completed_with_digest_and_counts() {
    let mut model = with_surfels_and_nodes();
    let epoch = model.advance(changes(&model, &[5], &[1, 4], &[9])).unwrap();
    assert_eq!(model.surfels().ids(), [1, 3, 4, 9]);
    assert_eq!(model.surfels().versions(), [2, 1, 2, 2]);
    assert_eq!((epoch.surfels, epoch.nodes, epoch.digest), (4, 2, model.digest().value()));
}

#[test]
fn what_does_not_fit_changes_nothing() {
    let mut model = with_surfels_and_nodes();
    let before = model.clone();
    let not_held = |what, id| ProtocolError::NotHeld { what, id };
    let held = |what, id| ProtocolError::AlreadyHeld { what, id };
    let good = || changes(&before, &[], &[], &[]);
    let broken = [
        (changes(&model, &[4], &[], &[]), not_held("surfel", 4)),
        (changes(&model, &[], &[], &[4]), not_held("surfel", 4)),
        (changes(&model, &[5], &[], &[5]), not_held("surfel", 5)),
        (changes(&model, &[], &[5], &[]), held("surfel", 5)),
        (ModelEpoch { base_epoch: 0, ..good() }, ProtocolError::WrongBase { held: 1, base: 0 }),
        (ModelEpoch { added_nodes: nodes(&[8]), ..good() }, held("node", 8)),
        (ModelEpoch { removed_node_ids: pack_ids(&[6]).unwrap(), ..good() }, not_held("node", 6)),
        (
            ModelEpoch { node_transforms: pack_transforms(&[NodeTransform::default()]), ..good() },
            ProtocolError::LengthMismatch { field: "node_transforms", got: 1, expected: 2 },
        ),
    ];
    for (epoch, expected) in broken {
        assert_eq!(model.advance(epoch), Err(expected));
        assert_eq!(model, before);
    }
}

#[test]
fn a_warp_moves_nodes_and_outdates_shapes_until_they_are_brought() {
    let mut model = with_surfels_and_nodes();
    let mut transform = NodeTransform::default();
    transform.0[..3].copy_from_slice(&[5, -6, 7]);
    let transforms = pack_transforms(&[transform, NodeTransform::default()]);
    let digest = model.digest();
    model.advance(ModelEpoch { node_transforms: transforms, ..changes(&model, &[], &[], &[]) }).unwrap();
    assert_eq!(model.nodes().positions(), [NodePosition([105, -206, 307]), NodePosition([100, -200, 300])]);
    assert_ne!(model.digest(), digest, "a lost warp is noticed");
    assert!(model.is_outdated());

    let held: Vec<_> = [9, 3, 5].map(|id| surfel(id, 0.02)).to_vec();
    model.refresh(&held).unwrap();
    assert!(!model.is_outdated());
    let first = &model.surfels().rows()[0];
    assert!((first.position_in_world_m()[0] - 0.02).abs() < 1.1e-5);
    let incomplete = ProtocolError::LengthMismatch { field: "held surfels", got: 2, expected: 3 };
    assert_eq!(model.refresh(&held[..2]), Err(incomplete));
    let foreign = [surfel(3, 0.0), surfel(4, 0.0), surfel(5, 0.0)];
    assert_eq!(model.refresh(&foreign), Err(ProtocolError::NotHeld { what: "surfel", id: 4 }));
}

#[test]
fn a_snapshot_holds_everything_once_and_what_is_near_together() {
    let mut model = with_surfels_and_nodes();
    let added: Vec<u32> = (100..100 + 2 * SNAPSHOT_CHUNK_SURFELS as u32).collect();
    let surfels: Vec<_> = added.iter().map(|&id| surfel(id, (id * 7919 % 5000) as f32 * 1e-5)).collect();
    let block = Some(pack_surfels(&surfels).unwrap());
    model.advance(ModelEpoch { added: block, ..changes(&model, &[], &[], &[]) }).unwrap();
    let chunks = model.snapshot().unwrap();
    assert_eq!(chunks.len(), 4);
    let mut ids = Vec::new();
    for placed in &chunks {
        let contents = ChunkContents::unpack(&placed.chunk).unwrap();
        let x_m = |record: &protocol::SurfelRecord| record.position_in_world_m()[0];
        let extent = contents.surfels.iter().map(|(.., record)| x_m(record));
        let (least, most) = extent.fold((f32::MAX, f32::MIN), |(a, b), x| (a.min(x), b.max(x)));
        assert!(placed.centre_in_world_m.is_none_or(|[x, ..]| (least..=most).contains(&x)));
        assert!(contents.surfels.is_empty() || most - least < 0.033, "{least} to {most}");
        assert_eq!(contents.nodes.is_some(), placed.chunk.index == 0);
        ids.extend(contents.surfels.iter().map(|(id, ..)| *id));
    }
    ids.sort_unstable();
    assert_eq!(ids, model.surfels().ids());
}

#[test]
fn a_thinned_model_has_the_wanted_surfels_all_nodes_and_a_digest_of_its_own() {
    let model = with_surfels_and_nodes();
    let thin = model.thinned(|id, _| id != 5).unwrap();
    assert_eq!(thin.surfels().ids(), [3, 9]);
    assert_eq!((thin.nodes(), thin.epoch()), (model.nodes(), model.epoch()));
    assert_ne!(thin.digest(), model.digest());
}

#[test]
fn an_emptied_model_goes_on_from_the_same_epochs() {
    let mut model = with_surfels_and_nodes();
    let epoch = model.advance(model.clearing().unwrap()).unwrap();
    assert_eq!((epoch.epoch, epoch.surfels, epoch.nodes, epoch.digest), (2, 0, 0, 0));
}
