//! Nodes and their transforms: golden bytes, round trips, error bounds, refusals.

use proptest::prelude::*;
use protocol::v1::PackedNodes;
use protocol::{
    AFFINE_STEP, NODE_STEP_M, NodePosition, NodeTransform, ProtocolError, limits, pack_ids, pack_nodes,
    pack_transforms, unpack_nodes, unpack_transforms,
};

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn the_example_of_the_specification_packs_to_its_bytes() {
    let transform = NodeTransform([250, -1, 0, 300, 0, 0, 0, -41, 0, 0, 0, 1]);
    let bytes = hex(&pack_transforms(&[transform]));
    assert_eq!(bytes, "f40101000000580200000000000051000000000000000200");
    assert!(include_str!("../SPEC.md").contains(&bytes));
    let [tx_m, ..] = transform.translation_m();
    assert!((tx_m - 0.001).abs() < 1e-9);
    assert!((transform.affine()[0][0] - (1.0 + 300.0 / 4096.0)).abs() < 1e-7);
}

#[test]
fn low_and_high_bytes_lie_in_planes() {
    let one = |code| NodeTransform([code, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let bytes = pack_transforms(&[one(1), one(-200), one(i16::MIN)]);
    assert_eq!(hex(&bytes[..6]), "028fff0001ff");
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let bytes = pack_transforms(&[NodeTransform::default(); 2]);
    let field = "node_transforms";
    let ragged = ProtocolError::RaggedArray { field, bytes: 47, element_bytes: 24 };
    assert_eq!(unpack_transforms(&bytes[..47], 2), Err(ragged));
    assert_eq!(
        unpack_transforms(&bytes, 3),
        Err(ProtocolError::LengthMismatch { field, got: 2, expected: 3 })
    );
    let no_places = PackedNodes { ids: pack_ids(&[1]).unwrap(), positions: Default::default() };
    let lack = ProtocolError::LengthMismatch { field: "node positions", got: 0, expected: 1 };
    assert_eq!(unpack_nodes(&no_places), Err(lack));
    let many = limits::MAX_NODES + 1;
    let crowd = PackedNodes { ids: vec![0; many].into(), positions: vec![0; 12 * many].into() };
    let limit = limits::MAX_NODES;
    assert_eq!(unpack_nodes(&crowd), Err(ProtocolError::TooMany { field: "nodes", got: many, limit }));
}

proptest! {
    #[test]
    fn any_transforms_survive(codes in prop::collection::vec(any::<[i16; 12]>(), 0..20)) {
        let transforms: Vec<_> = codes.into_iter().map(NodeTransform).collect();
        prop_assert_eq!(unpack_transforms(&pack_transforms(&transforms), transforms.len()), Ok(transforms));
    }

    #[test]
    fn any_nodes_survive(nodes in prop::collection::btree_map(any::<u32>(), any::<[i32; 3]>(), 0..20)) {
        let nodes: Vec<_> = nodes.into_iter().map(|(id, place)| (id, NodePosition(place))).collect();
        let (ids, places): (Vec<_>, Vec<_>) = nodes.iter().copied().unzip();
        prop_assert_eq!(unpack_nodes(&pack_nodes(&ids, &places).unwrap()), Ok(nodes));
    }

    #[test]
    fn a_place_is_off_by_half_a_step_at_most(place_m in prop::array::uniform3(-20.0_f32..20.0)) {
        for (got, sent) in NodePosition::pack(place_m).unpack().into_iter().zip(place_m) {
            prop_assert!((f64::from(got) - f64::from(sent)).abs() <= NODE_STEP_M / 2.0 + 2e-6);
        }
    }

    #[test]
    fn hostile_nodes_end_in_an_error_or_a_value(
        ids in prop::collection::vec(any::<u8>(), 0..40),
        positions in prop::collection::vec(any::<u8>(), 0..120),
        transforms in prop::collection::vec(any::<u8>(), 0..120),
        nodes in 0_usize..6,
    ) {
        let count = positions.len() / 12;
        if let Ok(unpacked) = unpack_nodes(&PackedNodes { ids: ids.into(), positions: positions.into() }) {
            prop_assert_eq!(unpacked.len(), count);
        }
        if let Ok(unpacked) = unpack_transforms(&transforms, nodes) {
            prop_assert_eq!(unpacked.len(), nodes);
            prop_assert!(unpacked.iter().flat_map(NodeTransform::affine).flatten().all(f32::is_finite));
        }
    }
}

#[test]
fn steps_are_those_of_the_specification() {
    assert_eq!((NODE_STEP_M, AFFINE_STEP), (0.000_004, 1.0 / 4096.0));
}
