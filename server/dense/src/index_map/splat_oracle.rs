//! CPU mirror of the two splat kernels.

use nalgebra::{Point3, Vector3};

use super::{IndexMap, SplatSettings};
use crate::View;
use crate::store::{ALIVE, STABLE, SurfelRows};
use crate::testing::Fixture;

/// The slot that each cell shows, and the depth by which it won.
fn index_map(view: &View, rows: &SurfelRows, settings: &SplatSettings) -> Vec<Option<(u32, f64)>> {
    let scale = f64::from(settings.scale);
    let (width, height) = (
        (view.pinhole.width_px * settings.scale) as usize,
        (view.pinhole.height_px * settings.scale) as usize,
    );
    let camera = &view.pinhole;
    let (fx, fy) = (camera.fx_px * scale, camera.fy_px * scale);
    let (cx, cy) = ((camera.cx_px + 0.5) * scale - 0.5, (camera.cy_px + 0.5) * scale - 0.5);
    let mut cells: Vec<Option<(bool, f32, u32)>> = vec![None; width * height];
    for slot in 0..settings.slots as usize {
        let [x, y, z, radius] = rows.geometry[slot].map(f64::from);
        let state = rows.history[slot][3];
        let stable = state & STABLE != 0;
        let center = view.world_from_camera.inverse() * Point3::new(x, y, z);
        let [nx, ny, nz, _] = rows.orientation[slot].map(f64::from);
        let normal = view.world_from_camera.rotation.inverse() * Vector3::new(nx, ny, nz);
        let facing = normal.dot(&center.coords);
        let shown = state & ALIVE != 0 && (stable || settings.stable_only == 0);
        if !shown || !facing.is_finite() || !radius.is_finite() || center.z < 1e-4 || facing >= 0.0 {
            continue;
        }
        let at = (center.x / center.z * fx + cx, center.y / center.z * fy + cy);
        let reach = (radius * fx / center.z).clamp(0.5, f64::from(settings.reach_max));
        let span = |middle: f64, size: usize| {
            let first = (middle - reach).ceil().max(0.0) as usize;
            first..((middle + reach).floor().min(size as f64 - 1.0) + 1.0).max(0.0) as usize
        };
        for row in span(at.1, height) {
            for column in span(at.0, width) {
                let direction = Vector3::new((column as f64 - cx) / fx, (row as f64 - cy) / fy, 1.0);
                let offset = direction * (facing / normal.dot(&direction)) - center.coords;
                let own = (at.0.round(), at.1.round()) == (column as f64, row as f64);
                let candidate = (!stable, center.z as f32, slot as u32);
                let cell = &mut cells[row * width + column];
                if (own || offset.norm() <= radius) && cell.is_none_or(|held| candidate < held) {
                    *cell = Some(candidate);
                }
            }
        }
    }
    cells.into_iter().map(|cell| cell.map(|(_, depth, slot)| (slot, f64::from(depth)))).collect()
}

fn run(fixture: &Fixture, settings: &SplatSettings) -> Vec<u32> {
    let cells = fixture.pixels() * (settings.scale * settings.scale) as usize;
    let crate::model::FrameBuffers { view, store, results, .. } = &fixture.buffers;
    let map = IndexMap::new(&fixture.gpu, view, store, results, cells).unwrap();
    let timer = gpu::StageTimer::new(&fixture.gpu, 2).unwrap();
    let mut frame = gpu::FrameRecorder::begin(&fixture.gpu, &timer);
    map.record(&fixture.gpu, &mut frame, settings).unwrap();
    frame.submit().collect().unwrap();
    fixture.gpu.read(&map.slots).unwrap()
}

fn agreement(scale: u32, stable_only: u32) {
    let fixture = Fixture::with_index_scale(3, scale);
    let settings = SplatSettings {
        slots: fixture.settings.slots,
        scale,
        stable_only,
        reach_max: 16.0 * scale as f32,
        forget_before: 0,
        tick: 0,
    };
    let cells = run(&fixture, &settings);
    let expected = index_map(&fixture.view, &fixture.rows, &settings);
    let shown = expected.iter().flatten().count();
    assert!(shown > 100, "{shown}");
    // single precision may decide otherwise only at the rim of a disc
    let differ = (0..cells.len())
        .filter(|&cell| (cells[cell] != 0).then(|| !cells[cell]) != expected[cell].map(|(slot, _)| slot))
        .count();
    assert!(differ * 100 <= shown, "{differ} of {shown} cells differ");
    assert_eq!(run(&fixture, &settings), cells, "two runs");
}

#[test]
fn the_index_map_agrees_with_its_oracle() {
    agreement(1, 0);
    agreement(1, 1);
}

#[test]
fn a_supersampled_index_map_agrees_with_its_oracle() {
    agreement(2, 0);
    agreement(4, 0);
}
