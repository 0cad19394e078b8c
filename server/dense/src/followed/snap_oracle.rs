//! CPU mirror of `snap_points.wgsl`.

use gpu::{FrameRecorder, StageTimer};
use nalgebra::{Point3, Vector3};

use super::{FollowedPoints, Shown, snap_points};
use crate::index_map::SplatSettings;
use crate::node_graph::GraphSettings;
use crate::store::{ALIVE, STABLE};
use crate::testing::{Fixture, Numbers, in_world};

/// Where the oracle takes a point, given what each pixel shows.
fn snapped(fixture: &Fixture, slots: &[u32], point: &Point3<f64>) -> Point3<f64> {
    let camera = &fixture.view.pinhole;
    let at = camera.project(&(fixture.view.world_from_camera.inverse() * point));
    let (x, y) = (at.x.round(), at.y.round());
    if !(0.0..f64::from(camera.width_px)).contains(&x) || !(0.0..f64::from(camera.height_px)).contains(&y) {
        return *point;
    }
    let stored = slots[y as usize * camera.width_px as usize + x as usize];
    let slot = !stored as usize;
    if stored == 0 || fixture.rows.history[slot][3] & (ALIVE | STABLE) != ALIVE | STABLE {
        return *point;
    }
    let [sx, sy, sz, radius_m] = fixture.rows.geometry[slot].map(f64::from);
    let [nx, ny, nz, _] = fixture.rows.orientation[slot].map(f64::from);
    let (center, normal) = (Point3::new(sx, sy, sz), Vector3::new(nx, ny, nz));
    let off_m = normal.dot(&(point - center));
    let moved = point - off_m * normal;
    let same = off_m.abs() < 1.5e-3 && (moved - center).norm() < 3.0 * radius_m;
    if same { moved } else { *point }
}

#[test]
fn snapping_agrees_with_its_oracle() {
    let fixture = Fixture::new(12);
    let (gpu, buffers) = (&fixture.gpu, &fixture.buffers);
    let settings = GraphSettings::new(&crate::testing::config().nodes);
    let mut followed = FollowedPoints::new(gpu, settings).unwrap();
    let mut numbers = Numbers::new(4);
    let place = |numbers: &mut Numbers| {
        let around = numbers.vector();
        let at = Vector3::new(0.03 * around.x, 0.025 * around.y, 0.06 + 0.003 * around.z);
        Point3::from(in_world(&fixture.view, at).map(|x| f64::from(x as f32)))
    };
    let points: Vec<(u32, Point3<f64>)> = (0..777).map(|id| (id, place(&mut numbers))).collect();
    followed.add(gpu, settings, &points).unwrap();
    let shown = Shown {
        view: &buffers.view,
        index_scale: &buffers.index_scale,
        index_map: &buffers.index_map,
        surfels: &buffers.store,
    };
    let snap = snap_points::bind(gpu, &shown, &followed.carried.settings, &followed.carried.rows).unwrap();
    let slots = fixture.settings.slots;
    let splat = SplatSettings { slots, scale: 1, stable_only: 0, reach_max: 16.0, forget_before: 0, tick: 0 };
    let timer = StageTimer::new(gpu, 4).unwrap();
    let mut frame = FrameRecorder::begin(gpu, &timer);
    buffers.index_map.record(gpu, &mut frame, &splat).unwrap();
    frame.stage("snap", |stage| stage.run(&snap, [777, 1, 1])).unwrap();
    frame.submit().collect().unwrap();
    let slots = gpu.read(&buffers.index_map.slots).unwrap();
    let found = followed.read(gpu).unwrap();
    let mut moved = 0;
    let mut differ = 0;
    for ((id, before), (found_id, found)) in points.iter().zip(&found) {
        let expected = snapped(&fixture, &slots, before);
        moved += usize::from(expected != *before);
        differ += usize::from((found - expected).norm() > 1e-7 || id != found_id);
    }
    // single precision may decide otherwise only at a limit
    assert!(moved > 20 && differ <= 2, "{moved} moved, {differ} differ");
}
