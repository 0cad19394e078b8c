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
    let settings =
        SplatSettings { slots: SLOTS as u32, scale: 1, stable_only: 0, reach_max: 16.0, forget_before: 28 };
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
