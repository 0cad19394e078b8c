//! Discs drawn into a canvas, against what geometry says.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::sync::Arc;

use geometry::{Pinhole, Pose, Rgb};
use gpu::{AdapterSelection, Gpu};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use render::{Canvas, Coloring, DiscRenderer, Eye, Style, SurfelRow, SurfelUpload, Viewport};

const SIZE: (u32, u32) = (97, 64);
const STYLE: Style =
    Style { coloring: Coloring::Colour, weight_max: 1.0, fade: 0.0, background: [18, 18, 22] };
const WHOLE: Viewport = Viewport { x: 0, y: 0, width: SIZE.0, height: SIZE.1 };

fn gpu() -> Arc<Gpu> {
    let selection = AdapterSelection { adapter: String::new() }.with_environment();
    Arc::new(Gpu::open(&selection).unwrap())
}

fn camera() -> Pinhole {
    Pinhole { width_px: SIZE.0, height_px: SIZE.1, fx_px: 80.0, fy_px: 75.0, cx_px: 40.0, cy_px: 35.0 }
}

fn row(position_in_world_m: [f32; 3], normal_in_world: [f32; 3], color: [u8; 3]) -> SurfelRow {
    SurfelRow { position_in_world_m, normal_in_world, radius_m: 0.005, color, weight: 0.5 }
}

fn draw(surfels: &[SurfelRow], eyes: &[Eye], style: &Style) -> Rgb {
    let gpu = gpu();
    let canvas = Canvas::new(&gpu, SIZE).unwrap();
    let discs = DiscRenderer::new(gpu.clone(), Canvas::FORMAT).unwrap();
    let mut upload = SurfelUpload::new(&gpu).unwrap();
    upload.replace(&gpu, surfels).unwrap();
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    discs.draw(&mut encoder, canvas.target(), (eyes, style), upload.arrays()).unwrap();
    gpu.queue().submit([encoder.finish()]);
    canvas.read(&gpu).unwrap()
}

fn from(world_from_camera: Pose) -> [Eye; 1] {
    [Eye { pinhole: camera(), world_from_camera, viewport: WHOLE }]
}

fn is_background(pixel: [u8; 3]) -> bool {
    pixel == STYLE.background
}

#[test]
fn a_disc_covers_the_pixels_whose_rays_meet_it() {
    let turned = UnitQuaternion::from_euler_angles(0.1, -0.2, 0.3);
    let world_from_camera = Pose::from_parts(Vector3::new(0.01, -0.02, 0.03).into(), turned);
    let (center, normal) = (Point3::new(0.004, -0.003, 0.05), Vector3::new(0.5, 0.2, -0.9).normalize());
    let (in_world, facing) = (world_from_camera * center, world_from_camera * normal);
    let surfel = row(
        in_world.coords.map(|value| value as f32).into(),
        facing.map(|value| value as f32).into(),
        [200, 100, 50],
    );
    let picture = draw(&[surfel], &from(world_from_camera), &STYLE);
    // The disc reaches sqrt(2) times the surfel's radius, which closes a square grid.
    let radius = 0.005 * 2.0_f64.sqrt();
    for (x, y) in (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))) {
        let ray = camera().back_project(&nalgebra::Point2::new(f64::from(x), f64::from(y)), 1.0);
        let met = ray * (normal.dot(&center.coords) / normal.dot(&ray.coords));
        let inside = (met - center).norm() / radius;
        if !(0.97..1.03).contains(&inside) {
            assert_eq!(!is_background(picture[(x, y)]), inside < 1.0, "pixel {x}, {y}: {inside}");
        }
    }
    let seen = camera().project(&center);
    let light = 0.55 + 0.45 * normal.dot(&-center.coords.normalize());
    let [red, ..] = picture[(seen.x.round() as u32, seen.y.round() as u32)];
    assert!((f64::from(red) - 200.0 * light).abs() < 1.0, "{red} for {}", 200.0 * light);
}

#[test]
fn the_nearer_disc_hides_the_farther_one_whatever_their_order() {
    let near = row([0.0, 0.0, 0.05], [0.0, 0.0, -1.0], [250, 0, 0]);
    let far = row([0.001, 0.0, 0.06], [0.0, 0.0, -1.0], [0, 250, 0]);
    for surfels in [[near, far], [far, near]] {
        let picture = draw(&surfels, &from(Pose::identity()), &STYLE);
        assert_eq!(picture[(40, 35)], [250, 0, 0]);
    }
}

#[test]
fn what_is_no_disc_is_not_drawn() {
    let mut surfels = Vec::new();
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut position = [0.0, 0.0, 0.05];
            position[axis] = value;
            surfels.push(row(position, [0.0, 0.0, -1.0], [255; 3]));
            let mut normal = [0.0, 0.0, -1.0];
            normal[axis] = value;
            surfels.push(row([0.0, 0.0, 0.05], normal, [255; 3]));
        }
        surfels.push(SurfelRow { radius_m: value, ..row([0.0, 0.0, 0.05], [0.0, 0.0, -1.0], [255; 3]) });
    }
    surfels.push(row([0.0, 0.0, -0.05], [0.0, 0.0, -1.0], [255; 3]));
    let picture = draw(&surfels, &from(Pose::identity()), &STYLE);
    assert!(picture.pixels().iter().all(|&pixel| is_background(pixel)));
    let empty = draw(&[], &from(Pose::identity()), &STYLE);
    assert!(empty.pixels().iter().all(|&pixel| is_background(pixel)));
}

#[test]
fn a_stale_model_goes_grey_and_dark() {
    let surfel = row([0.0, 0.0, 0.05], [0.0, 0.0, -1.0], [250, 20, 20]);
    let [red, green, blue] =
        draw(&[surfel], &from(Pose::identity()), &Style { fade: 1.0, ..STYLE })[(40, 35)];
    assert!(red < 100 && red.abs_diff(green) < 3 && green.abs_diff(blue) < 5, "{red} {green} {blue}");
}

#[test]
fn two_eyes_have_a_half_each() {
    let surfel = row([0.0, 0.0, 0.05], [0.0, 0.0, -1.0], [250, 20, 20]);
    let half = |x, shift_m| Eye {
        pinhole: camera(),
        world_from_camera: Pose::translation(shift_m, 0.0, 0.0),
        viewport: Viewport { x, width: SIZE.0 / 2, ..WHOLE },
    };
    let picture = draw(&[surfel], &[half(0, -2e-3), half(48, 2e-3)], &STYLE);
    let columns = |range: std::ops::Range<u32>| {
        let shown = range.filter(|&x| !is_background(picture[(x, 35)])).collect::<Vec<_>>();
        (f64::from(shown[0]) + f64::from(shown[shown.len() - 1])) / 2.0
    };
    let (left, right) = (columns(0..48), columns(48..96) - 48.0);
    // 4 mm at 50 mm and 80 px are 6.4 px of the camera's image, which is squeezed to a half.
    assert!((left - right - 3.2).abs() < 0.8, "{left} {right}");
}

#[test]
fn the_shaders_are_valid_by_themselves() {
    for wgsl in [include_str!("../src/discs.wgsl"), include_str!("../src/overlay.wgsl")] {
        let module = naga::front::wgsl::parse_str(&gpu::resolve_imports(wgsl).unwrap()).unwrap();
        let all = naga::valid::ValidationFlags::all();
        naga::valid::Validator::new(all, naga::valid::Capabilities::default()).validate(&module).unwrap();
    }
}
