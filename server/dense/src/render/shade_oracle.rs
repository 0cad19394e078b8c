//! CPU mirror of `shade.wgsl`.

use nalgebra::{Point2, Point3, Vector3};

use super::shade;
use crate::testing::{Fixture, SLOTS};

const BACKGROUND: u32 = 0xff30_2010;

#[test]
fn shading_agrees_with_the_oracle() {
    let fixture = Fixture::new(31);
    let (gpu, camera) = (&fixture.gpu, &fixture.view.pinhole);
    let slots: Vec<u32> = (0..fixture.pixels())
        .map(|pixel| if pixel % 4 == 0 || pixel % SLOTS % 17 == 16 { 0 } else { !((pixel % SLOTS) as u32) })
        .collect();
    let map = gpu.storage_from("slots", &slots).unwrap();
    let background = gpu.uniform("background", &BACKGROUND).unwrap();
    let (pixels, depth) =
        (gpu.storage::<u32>("pixels", slots.len()), gpu.storage::<f32>("depth", slots.len()));
    let (pixels, depth) = (pixels.unwrap(), depth.unwrap());
    let store = &fixture.buffers.store;
    let kernel =
        shade::bind(gpu, (&fixture.buffers.view, &background), &map, store, (&pixels, &depth)).unwrap();
    let timer = gpu::StageTimer::new(gpu, 1).unwrap();
    let mut frame = gpu::FrameRecorder::begin(gpu, &timer);
    frame.stage("shade", |stage| stage.run(&kernel, [camera.width_px, camera.height_px, 1])).unwrap();
    frame.submit().collect().unwrap();
    let (pixels, depth) = (gpu.read(&pixels).unwrap(), gpu.read(&depth).unwrap());
    for pixel in 0..slots.len() {
        if slots[pixel] == 0 {
            assert_eq!((pixels[pixel], depth[pixel]), (BACKGROUND, 0.0));
            continue;
        }
        let slot = !slots[pixel] as usize;
        let at = Point2::new((pixel % 37) as f64, (pixel / 37) as f64);
        let ray = camera.back_project(&at, 1.0).coords;
        let camera_from_world = fixture.view.world_from_camera.inverse();
        let [x, y, z, radius] = fixture.rows.geometry[slot].map(f64::from);
        let center = camera_from_world * Point3::new(x, y, z);
        let [nx, ny, nz, _] = fixture.rows.orientation[slot].map(f64::from);
        let normal = camera_from_world.rotation * Vector3::new(nx, ny, nz);
        let light = 0.55 + 0.45 * (-normal.dot(&ray.normalize())).max(0.0);
        let met = normal.dot(&center.coords) / normal.dot(&ray);
        let expected = met.max(center.z - radius).min(center.z + radius);
        assert!((f64::from(depth[pixel]) - expected).abs() < 1e-6, "pixel {pixel}");
        for channel in 0..3 {
            let level = f64::from(fixture.rows.appearance[slot][channel]) * light;
            let found = f64::from(pixels[pixel].to_le_bytes()[channel]);
            assert!((found - level.min(255.0)).abs() <= 0.51, "pixel {pixel}: {found} for {level}");
        }
    }
}
