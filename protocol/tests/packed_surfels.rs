//! The packed surfel: golden bytes, error bounds, refusals.

use proptest::prelude::*;
use protocol::v1::PackedSurfels;
use protocol::{
    POSITION_STEP_M, ProtocolError, SurfelRecord, WireSurfel, pack_ids, pack_surfels, unpack_ids,
    unpack_surfels, unpack_versions,
};

fn surfel() -> WireSurfel {
    WireSurfel {
        id: 7,
        position_in_world_m: [0.0123, -0.0456, 0.0789],
        normal_in_world: [0.0, 0.6, -0.8],
        radius_m: 0.0008,
        color: [200, 90, 70],
        confidence: 0.5,
    }
}

/// The example of SPEC.md.
const GOLDEN: &str = "670210e3fea53d4091ecff65c85a4680";

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn the_example_packs_to_the_golden_bytes() {
    assert_eq!(hex(&SurfelRecord::pack(&surfel()).unwrap().0), GOLDEN);
    assert!(include_str!("../SPEC.md").contains(GOLDEN));
}

#[test]
fn axes_keep_their_normals_exactly() {
    for axis in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]] {
        let packed = SurfelRecord::pack(&WireSurfel { normal_in_world: axis, ..surfel() }).unwrap();
        assert_eq!(packed.unpack(7).normal_in_world.map(f32::abs), axis.map(f32::abs));
    }
}

#[test]
fn values_without_a_packed_form_are_refused_by_name() {
    let refused = |change: fn(&mut WireSurfel)| {
        let mut broken = surfel();
        change(&mut broken);
        match SurfelRecord::pack(&broken).unwrap_err() {
            ProtocolError::Unpackable { id: 7, field, .. } => field,
            other => panic!("{other}"),
        }
    };
    assert_eq!(refused(|s| s.position_in_world_m[1] = f32::NAN), "y_m");
    assert_eq!(refused(|s| s.position_in_world_m[2] = 21.0), "z_m");
    assert_eq!(refused(|s| s.normal_in_world = [0.0; 3]), "normal");
    assert_eq!(refused(|s| s.normal_in_world[0] = f32::INFINITY), "normal");
    assert_eq!(refused(|s| s.radius_m = 0.0), "radius_m");
    assert_eq!(refused(|s| s.confidence = f32::NAN), "confidence");
}

#[test]
fn id_lists_are_gaps() {
    let ids = [0, 1, 2, 130, 131, u32::MAX];
    let bytes = pack_ids(&ids).unwrap();
    assert_eq!(hex(&bytes), "0000007f00fbfeffff0f");
    assert_eq!(unpack_ids("ids", &bytes), Ok(ids.to_vec()));
    let unsorted = ProtocolError::UnsortedIds { index: 1, id: 9, previous: 9 };
    assert_eq!(pack_ids(&[9, 9]), Err(unsorted));
    let beyond = [0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0x00];
    assert_eq!(unpack_ids("ids", &beyond), Err(ProtocolError::IdOverflow { field: "ids" }));
}

#[test]
fn records_are_packed_in_byte_planes() {
    let other = WireSurfel { id: 9, color: [1, 2, 3], ..surfel() };
    let records = pack_surfels(&[surfel(), other]).unwrap().records;
    assert_eq!(hex(&records[24..30]), "c8015a024603");
}

#[test]
fn arrays_that_do_not_fit_each_other_are_refused() {
    let good = pack_surfels(&[surfel(), WireSurfel { id: 9, ..surfel() }]).unwrap();
    let broken = |ids: &[u8], records: &[u8]| {
        unpack_surfels(&PackedSurfels { ids: ids.to_vec().into(), records: records.to_vec().into() })
            .unwrap_err()
    };
    let half_an_id = broken(&[7, 0x81], &good.records);
    assert_eq!(half_an_id, ProtocolError::Varint { field: "ids", index: 1 });
    let half_a_record = broken(&good.ids, &good.records[..31]);
    assert_eq!(half_a_record, ProtocolError::RaggedArray { field: "records", bytes: 31, element_bytes: 16 });
    let one_record_short = broken(&good.ids, &good.records[..16]);
    assert_eq!(one_record_short, ProtocolError::LengthMismatch { field: "records", got: 1, expected: 2 });
    let versions = unpack_versions(&good.ids, 10, 3).unwrap_err();
    assert_eq!(versions, ProtocolError::LengthMismatch { field: "versions", got: 2, expected: 3 });
}

#[test]
fn more_ids_than_the_limit_are_refused() {
    let limit = protocol::limits::MAX_SURFELS_PER_MESSAGE;
    let refused = unpack_ids("ids", &vec![0; limit + 1]).unwrap_err();
    assert_eq!(refused, ProtocolError::TooMany { field: "ids", got: limit + 1, limit });
}

fn direction() -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(-1.0_f32..1.0)
        .prop_filter("has a direction", |n| n.iter().map(|a| a * a).sum::<f32>() > 1e-4)
        .prop_map(|n| {
            let length = n.iter().map(|a| a * a).sum::<f32>().sqrt();
            n.map(|a| a / length)
        })
}

prop_compose! {
    fn any_surfel()(
        id in any::<u32>(),
        position_in_world_m in prop::array::uniform3(-20.0_f32..20.0),
        normal_in_world in direction(),
        radius_m in 2e-5_f32..0.5,
        color in any::<[u8; 3]>(),
        confidence in 0.0_f32..1.0,
    ) -> WireSurfel {
        WireSurfel { id, position_in_world_m, normal_in_world, radius_m, color, confidence }
    }
}

proptest! {
    #[test]
    fn packing_stays_within_its_bounds(surfel in any_surfel()) {
        let unpacked = SurfelRecord::pack(&surfel).unwrap().unpack(surfel.id);
        for (got, sent) in unpacked.position_in_world_m.into_iter().zip(surfel.position_in_world_m) {
            // Half a step, and the spacing of f32 at 20 m.
            prop_assert!((f64::from(got) - f64::from(sent)).abs() <= POSITION_STEP_M / 2.0 + 2e-6);
        }
        let [a, b] = [unpacked.normal_in_world, surfel.normal_in_world];
        let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let angle_rad = cross.iter().map(|c| c * c).sum::<f32>().sqrt();
        prop_assert!(angle_rad.to_degrees() < 0.06, "{} degrees", angle_rad.to_degrees());
        prop_assert!((unpacked.radius_m / surfel.radius_m).ln().abs() < 0.0225);
        prop_assert_eq!(unpacked.color, surfel.color);
        prop_assert!((unpacked.confidence - surfel.confidence).abs() <= 0.5 / 255.0 + 1e-6);
    }

    #[test]
    fn a_viewer_that_sends_on_what_it_holds_changes_nothing(surfel in any_surfel()) {
        let once = SurfelRecord::pack(&surfel).unwrap();
        let again = SurfelRecord::pack(&once.unpack(surfel.id)).unwrap();
        let position_and_color = |record: &SurfelRecord| (record.0[0..8].to_vec(), record.0[11..16].to_vec());
        prop_assert_eq!(position_and_color(&once), position_and_color(&again));
    }

    #[test]
    fn any_bytes_unpack_to_finite_values(bytes in any::<[u8; 16]>()) {
        let surfel = SurfelRecord(bytes).unpack(1);
        let values = surfel.position_in_world_m.into_iter().chain(surfel.normal_in_world);
        prop_assert!(values.chain([surfel.radius_m, surfel.confidence]).all(f32::is_finite));
    }

    #[test]
    fn hostile_arrays_end_in_an_error_or_a_value(
        ids in prop::collection::vec(any::<u8>(), 0..64),
        records in prop::collection::vec(any::<u8>(), 0..256),
    ) {
        let surfels = records.len() / 16;
        if let Ok(unpacked) = unpack_surfels(&PackedSurfels { ids: ids.into(), records: records.into() }) {
            prop_assert_eq!(unpacked.len(), surfels);
            prop_assert!(unpacked.windows(2).all(|pair| pair[0].id < pair[1].id));
        }
    }

    #[test]
    fn any_ids_survive(ids in prop::collection::btree_set(any::<u32>(), 0..100)) {
        let ids: Vec<u32> = ids.into_iter().collect();
        prop_assert_eq!(unpack_ids("ids", &pack_ids(&ids).unwrap()), Ok(ids));
    }
}
