//! CPU mirror of `shade.wgsl`.

use nalgebra::{Point2, Point3, Vector3};

use super::Coloring;
use super::shade::{self, ShadeSettings};
use crate::testing::{Fixture, SLOTS};

const BACKGROUND: [u8; 3] = [0x10, 0x20, 0x30];
const WEIGHT_MAX: f32 = 20.0;

/// Red, green, blue of `shared/shading.wgsl`, before rounding.
fn shaded(coloring: Coloring, rgb: [f64; 3], normal: Vector3<f64>, facing: f64, confidence: f64) -> [f64; 3] {
    const STOPS: [[f64; 3]; 5] = [
        [68.0, 1.0, 84.0],
        [59.0, 82.0, 139.0],
        [33.0, 145.0, 140.0],
        [94.0, 201.0, 98.0],
        [253.0, 231.0, 37.0],
    ];
    match coloring {
        Coloring::Colour => rgb.map(|level| level * (0.55 + 0.45 * facing)),
        Coloring::Shape => [204.0, 199.0, 191.0].map(|level| level * (0.16 + 0.84 * facing * facing)),
        Coloring::Normal => [normal.x, -normal.y, -normal.z].map(|value| 127.5 + 127.5 * value),
        Coloring::Confidence => {
            let place = confidence.clamp(0.0, 1.0) * 4.0;
            let start = (place as usize).min(3);
            let part = place - start as f64;
            let level =
                |channel: usize| STOPS[start][channel] * (1.0 - part) + STOPS[start + 1][channel] * part;
            [0, 1, 2].map(|channel| level(channel) * (0.82 + 0.18 * facing))
        }
    }
}

/// Runs the kernel over the fixture's view.
fn shade_by_gpu(fixture: &Fixture, slots: &[u32], coloring: Coloring) -> (Vec<u32>, Vec<f32>) {
    let (gpu, camera) = (&fixture.gpu, &fixture.view.pinhole);
    let map = gpu.storage_from("slots", slots).unwrap();
    let settings = ShadeSettings::new(BACKGROUND, coloring, WEIGHT_MAX);
    let settings = gpu.uniform("settings", &settings).unwrap();
    let (pixels, depth) =
        (gpu.storage::<u32>("pixels", slots.len()), gpu.storage::<f32>("depth", slots.len()));
    let (pixels, depth) = (pixels.unwrap(), depth.unwrap());
    let store = &fixture.buffers.store;
    let kernel =
        shade::bind(gpu, (&fixture.buffers.view, &settings), &map, store, (&pixels, &depth)).unwrap();
    let timer = gpu::StageTimer::new(gpu, 1).unwrap();
    let mut frame = gpu::FrameRecorder::begin(gpu, &timer);
    frame.stage("shade", |stage| stage.run(&kernel, [camera.width_px, camera.height_px, 1])).unwrap();
    frame.submit().collect().unwrap();
    (gpu.read(&pixels).unwrap(), gpu.read(&depth).unwrap())
}

#[test]
fn shading_agrees_with_the_oracle_in_every_colouring() {
    let fixture = Fixture::new(31);
    let slots: Vec<u32> = (0..fixture.pixels())
        .map(|pixel| if pixel % 4 == 0 || pixel % SLOTS % 17 == 16 { 0 } else { !((pixel % SLOTS) as u32) })
        .collect();
    for coloring in [Coloring::Colour, Coloring::Shape, Coloring::Normal, Coloring::Confidence] {
        let (pixels, depth) = shade_by_gpu(&fixture, &slots, coloring);
        for pixel in 0..slots.len() {
            if slots[pixel] == 0 {
                assert_eq!((pixels[pixel], depth[pixel]), (0xff30_2010, 0.0));
                continue;
            }
            check_pixel(&fixture, coloring, (pixel, !slots[pixel] as usize), (pixels[pixel], depth[pixel]));
        }
    }
}

fn check_pixel(
    fixture: &Fixture,
    coloring: Coloring,
    (pixel, slot): (usize, usize),
    (shown, depth): (u32, f32),
) {
    let at = Point2::new((pixel % 37) as f64, (pixel / 37) as f64);
    let ray = fixture.view.pinhole.back_project(&at, 1.0).coords;
    let camera_from_world = fixture.view.world_from_camera.inverse();
    let [x, y, z, radius] = fixture.rows.geometry[slot].map(f64::from);
    let center = camera_from_world * Point3::new(x, y, z);
    let [nx, ny, nz, weight] = fixture.rows.orientation[slot].map(f64::from);
    let normal = camera_from_world.rotation * Vector3::new(nx, ny, nz);
    let facing = (-normal.dot(&ray.normalize())).max(0.0);
    let met = normal.dot(&center.coords) / normal.dot(&ray);
    let expected = met.max(center.z - radius).min(center.z + radius);
    assert!((f64::from(depth) - expected).abs() < 1e-6, "pixel {pixel}");
    let [red, green, blue, _] = fixture.rows.appearance[slot].map(f64::from);
    let levels = shaded(coloring, [red, green, blue], normal, facing, weight / f64::from(WEIGHT_MAX));
    for (level, found) in levels.into_iter().zip(shown.to_le_bytes()) {
        let off = (f64::from(found) - level.min(255.0)).abs();
        assert!(off <= 0.51, "{coloring:?}, pixel {pixel}: {found} for {level}");
    }
}
