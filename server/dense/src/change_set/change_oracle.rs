//! CPU mirror of `compare_published.wgsl` and `emit_changes.wgsl`.

use gpu::{FrameRecorder, PrefixSum, StageTimer};

use super::{ChangeSet, EncodingSteps, HeldNodes, PublishedParts, Publisher};
use crate::config::PublishConfig;
use crate::node_graph::NodeStore;
use crate::store::{ALIVE, Bits, STABLE, SurfelStore};
use crate::testing::{Fixture, SLOTS, config, upload};

const STEPS: EncodingSteps =
    EncodingSteps { position_m: 2e-5, position_max_m: 20.0, node_m: 4e-6, affine: 1.0 / 4096.0 };

/// What viewers hold before: every third surfel not at all, the others near the truth or far from it.
fn holdings(fixture: &Fixture) -> (Vec<[f32; 4]>, Vec<[f32; 4]>, Vec<Bits>) {
    let (mut geometry, mut orientation) = (fixture.rows.geometry.clone(), fixture.rows.orientation.clone());
    let mut rest = Vec::new();
    for slot in 0..SLOTS {
        match slot % 8 {
            1 => geometry[slot][0] += 4e-4,
            2 => geometry[slot][3] += 4e-4,
            3 => orientation[slot][..3].rotate_left(1),
            4 => orientation[slot][3] += 12.0,
            5 => geometry[slot][1] += 1e-5,
            _ => (),
        }
        let [red, green, blue, _] = fixture.rows.appearance[slot].map(|level| level.round_ties_even() as u8);
        let green = if slot % 8 == 6 { green - 30 } else { green };
        let held = u32::from(slot % 3 != 0);
        rest.push([fixture.rows.history[slot][0], u32::from_le_bytes([red, green, blue, 255]), 0, held]);
    }
    (geometry, orientation, rest)
}

/// 0 added, 1 updated, 2 removed.
fn expected_kind(fixture: &Fixture, slot: usize) -> Option<u32> {
    let shown = fixture.rows.history[slot][3] & (ALIVE | STABLE) == ALIVE | STABLE;
    let differs = matches!(slot % 8, 1..=4 | 6);
    match (shown, !slot.is_multiple_of(3)) {
        (true, false) => Some(0),
        (true, true) if differs => Some(1),
        (false, true) => Some(2),
        _ => None,
    }
}

fn take(batch: u32) -> (Fixture, ChangeSet, ChangeSet) {
    let mut fixture = Fixture::new(21);
    for row in &mut fixture.rows.geometry {
        // differences of what is no number are not compared here
        *row = row.map(|value| if value.is_finite() { value } else { 0.05 });
    }
    let store: &SurfelStore = &fixture.buffers.store;
    upload(&fixture.gpu, store, &fixture.rows);
    let (geometry, orientation, rest) = holdings(&fixture);
    fixture.gpu.write(&store.held.geometry, 0, &geometry).unwrap();
    fixture.gpu.write(&store.held.orientation, 0, &orientation).unwrap();
    fixture.gpu.write(&store.held.rest, 0, &rest).unwrap();
    let marked = PrefixSum::new(&fixture.gpu, store.capacity() as usize).unwrap();
    let timer = StageTimer::new(&fixture.gpu, 16).unwrap();
    let nodes = NodeStore::new(&fixture.gpu, &config().nodes).unwrap();
    let mut held_nodes = HeldNodes::new(&fixture.gpu, &config().nodes).unwrap();
    let mut frame = FrameRecorder::begin(&fixture.gpu, &timer);
    nodes.clear(&mut frame);
    held_nodes.clear(&mut frame);
    frame.submit().collect().unwrap();
    let publish = PublishConfig { batch, ..config().publish };
    let parts =
        PublishedParts { store, nodes: &nodes, held_nodes: &held_nodes, changed: &marked, reach_m: 8e-3 };
    let publisher = Publisher::new(&fixture.gpu, &parts, &publish).unwrap();
    let mut take = || {
        let device = (&*fixture.gpu, &timer);
        publisher.take(device, &marked, &mut held_nodes, &STEPS, SLOTS as u32).unwrap()
    };
    let (first, second) = (take(), take());
    (fixture, first, second)
}

#[test]
fn changes_agree_with_the_oracle_whatever_the_batch() {
    for batch in [7, 100_000] {
        let (fixture, changes, again) = take(batch);
        let ids = |kind: u32| -> Vec<u32> {
            let of_kind = (0..SLOTS).filter(|&slot| expected_kind(&fixture, slot) == Some(kind));
            of_kind.map(|slot| fixture.rows.history[slot][0]).collect()
        };
        let found = |surfels: &[crate::Surfel]| surfels.iter().map(|surfel| surfel.id).collect::<Vec<_>>();
        assert_eq!(found(&changes.added), ids(0));
        assert_eq!(found(&changes.updated), ids(1));
        assert_eq!(changes.removed, ids(2));
        assert!(again.is_empty(), "taken over into the published copy");
        for surfel in changes.added.iter().chain(&changes.updated) {
            let slot = surfel.id as usize / 10;
            for (sent, place) in surfel.position.iter().zip(fixture.rows.geometry[slot]) {
                assert!((sent - place).abs() <= 1.001e-5, "on the grid: {sent} {place}");
            }
            assert_eq!(surfel.weight, fixture.rows.orientation[slot][3]);
        }
    }
}
