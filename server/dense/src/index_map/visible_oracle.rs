//! CPU mirror of the list of visible surfels.

use nalgebra::Point3;

use super::{IndexMap, SplatSettings};
use crate::store::{ALIVE, STABLE};
use crate::testing::{Fixture, SLOTS};

/// Whether a surfel is in view, and by how much (pixels) it is or is not.
fn in_view(fixture: &Fixture, slot: usize) -> (bool, f64) {
    let [x, y, z, radius] = fixture.rows.geometry[slot].map(f64::from);
    let center = fixture.view.world_from_camera.inverse() * Point3::new(x, y, z);
    if !center.coords.iter().all(|value| value.is_finite()) || !radius.is_finite() || center.z < 1e-4 {
        return (false, 1.0);
    }
    let camera = &fixture.view.pinhole;
    let at = camera.project(&center);
    let reach = 1.0 + radius * camera.fx_px / center.z;
    let (right, bottom) = (f64::from(camera.width_px) - 1.0, f64::from(camera.height_px) - 1.0);
    let inside = [at.x + reach, at.y + reach, right + reach - at.x, bottom + reach - at.y];
    let least = inside.into_iter().fold(f64::INFINITY, f64::min);
    (least > 0.0, least.abs())
}

#[test]
fn surfels_in_view_are_listed_in_order_and_forgotten_ones_deleted() {
    let fixture = Fixture::new(21);
    let buffers = &fixture.buffers;
    let settings = SplatSettings {
        slots: SLOTS as u32,
        scale: 1,
        stable_only: 0,
        reach_max: 16.0,
        forget_before: 28,
        tick: 0,
    };
    let map = IndexMap::new(&fixture.gpu, &buffers.view, &buffers.store, &buffers.results, fixture.pixels())
        .unwrap();
    fixture.write_results(&[0; 8]);
    let timer = gpu::StageTimer::new(&fixture.gpu, 2).unwrap();
    let mut frame = gpu::FrameRecorder::begin(&fixture.gpu, &timer);
    map.record(&fixture.gpu, &mut frame, &settings).unwrap();
    frame.submit().collect().unwrap();
    let listed = fixture.gpu.read(&map.visible.slots).unwrap();
    let listed = &listed[1..=listed[0] as usize];
    let states: Vec<u32> = fixture.read().history.iter().map(|row| row[3]).collect();
    let mut died = 0;
    let (mut expected, mut close_calls) = (Vec::new(), Vec::new());
    for (slot, &left) in states.iter().enumerate() {
        let [_, seen, _, state] = fixture.rows.history[slot];
        let forgotten = state & ALIVE != 0 && state & STABLE == 0 && seen < 28;
        died += u32::from(forgotten);
        assert_eq!(left, if forgotten { 0 } else { state }, "slot {slot}");
        let (visible, margin) = in_view(&fixture, slot);
        if margin < 1e-3 {
            close_calls.push(slot as u32);
        } else if state & ALIVE != 0 && !forgotten && visible {
            expected.push(slot as u32);
        }
    }
    assert!(died > 10 && expected.len() > 100 && expected.len() < 300, "{died}, {}", expected.len());
    assert!(close_calls.len() < 4, "{close_calls:?}");
    let sure: Vec<u32> = listed.iter().copied().filter(|slot| !close_calls.contains(slot)).collect();
    assert_eq!(sure, expected);
    assert_eq!(fixture.gpu.read(&buffers.results).unwrap()[2], died);
    let groups = (listed.len() as u32).div_ceil(64);
    assert_eq!(fixture.gpu.read(&map.visible.groups).unwrap(), [groups, 1, 1]);
}

/// The slots that a map lists in a view.
fn listed(fixture: &Fixture, map: &IndexMap, settings: &SplatSettings) -> Vec<u32> {
    fixture.write_results(&[0; 8]);
    let timer = gpu::StageTimer::new(&fixture.gpu, 2).unwrap();
    let mut frame = gpu::FrameRecorder::begin(&fixture.gpu, &timer);
    map.record(&fixture.gpu, &mut frame, settings).unwrap();
    frame.submit().collect().unwrap();
    let listed = fixture.gpu.read(&map.visible.slots).unwrap();
    listed[1..=listed[0] as usize].to_vec()
}

/// A fixture of stable surfels, the chunks one beside the other.
fn calm_fixture() -> Fixture {
    let mut fixture = Fixture::new(22);
    for slot in 0..SLOTS {
        let at = Point3::new(-0.06 + 0.012 * (slot / 32) as f64, 2e-4 * (slot % 32) as f64, 0.06);
        let [x, y, z] = (fixture.view.world_from_camera * at).coords.map(|value| value as f32).into();
        fixture.rows.geometry[slot] = [x, y, z, 4e-4];
        fixture.rows.history[slot][3] = ALIVE | STABLE;
    }
    crate::testing::upload(&fixture.gpu, &fixture.buffers.store, &fixture.rows);
    fixture
}

#[test]
fn a_chunk_out_of_view_is_passed_over_until_it_comes_into_view_or_its_turn_comes() {
    let fixture = calm_fixture();
    let crate::model::FrameBuffers { view, store, results, .. } = &fixture.buffers;
    let map = IndexMap::new(&fixture.gpu, view, store, results, fixture.pixels()).unwrap();
    let at_tick = |tick: u32| SplatSettings {
        slots: SLOTS as u32,
        scale: 1,
        stable_only: 0,
        reach_max: 16.0,
        forget_before: 0,
        tick,
    };
    let expected: Vec<u32> = (0..SLOTS).filter(|&slot| in_view(&fixture, slot).0).map(|s| s as u32).collect();
    assert!(expected.len() > 60 && expected.len() < 260, "{}", expected.len());
    assert_eq!(listed(&fixture, &map, &at_tick(20)), expected, "the first look");
    assert_eq!(listed(&fixture, &map, &at_tick(21)), expected, "chunks out of view passed over");
    // what leaps into view from far away is seen when its chunk's turn comes
    let [hidden, shown] = [0, expected[0] as usize];
    fixture.gpu.write(&store.geometry, hidden, &[fixture.rows.geometry[shown]]).unwrap();
    assert!(!listed(&fixture, &map, &at_tick(22)).contains(&(hidden as u32)));
    assert!(listed(&fixture, &map, &at_tick(32)).contains(&(hidden as u32)));
    let timer = gpu::StageTimer::new(&fixture.gpu, 1).unwrap();
    let mut frame = gpu::FrameRecorder::begin(&fixture.gpu, &timer);
    map.visible.forget(&mut frame);
    frame.submit().collect().unwrap();
    fixture.gpu.write(&store.geometry, 32, &[fixture.rows.geometry[shown]]).unwrap();
    assert!(listed(&fixture, &map, &at_tick(22)).contains(&32), "all is looked at anew");
}
