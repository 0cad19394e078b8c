//! Pictures of the model.

use dense::{Coloring, View};

use crate::scene::{Bench, Scene, WALL_M, at, camera, config, evenly_lit, texture};

const SCENE: Scene = Scene { ball: true, noise_m: 0.1e-3 };
const BACKGROUND: [u8; 3] = [1, 2, 3];

#[test]
fn a_rendering_shows_the_surface_where_it_is() {
    let mut bench = Bench::new(&evenly_lit()).unwrap();
    for frame in 0..8 {
        bench.fuse(frame, &at(0.0), &SCENE.shoot(&at(0.0), u64::from(frame)));
    }
    let pose = at(1e-3);
    let rendering = bench
        .model
        .render(&View { pinhole: camera(), world_from_camera: pose }, Coloring::Colour, BACKGROUND)
        .unwrap();
    let truth = SCENE.depth(&pose);
    let inside = |pixel: usize| pixel % 160 < 150;
    let shown =
        (0..truth.len()).filter(|&pixel| inside(pixel) && rendering.depth.pixels()[pixel] > 0.0).count();
    let close = |pixel: &usize| (rendering.depth.pixels()[*pixel] - truth[*pixel]).abs() < 0.5e-3;
    let right = (0..truth.len()).filter(|&pixel| inside(pixel)).filter(close).count();
    eprintln!("{shown} shown, {right} right of {}", 150 * 120);
    assert!(right * 100 > 95 * 150 * 120, "{right} of {}", 150 * 120);
    let center_wall = rendering.rgb[(20, 20)];
    let point = camera().back_project(&nalgebra::Point2::new(20.0, 20.0), WALL_M) + pose.translation.vector;
    let expected = texture(&point);
    for channel in 0..3 {
        let off = f64::from(center_wall[channel]) / f64::from(expected[channel]);
        assert!((0.85..1.05).contains(&off), "{center_wall:?} for {expected:?}");
    }
}

#[test]
fn an_empty_model_shows_only_background() {
    let bench = Bench::new(&config()).unwrap();
    let rendering = bench
        .model
        .render(&View { pinhole: camera(), world_from_camera: at(0.0) }, Coloring::Colour, BACKGROUND)
        .unwrap();
    assert!(rendering.rgb.pixels().iter().all(|&pixel| pixel == BACKGROUND));
    assert!(rendering.depth.pixels().iter().all(|&depth| depth == 0.0));
}

#[test]
fn a_model_read_back_gives_the_picture_of_the_one_on_the_gpu() {
    let mut bench = Bench::new(&evenly_lit()).unwrap();
    for frame in 0..4 {
        bench.fuse(frame, &at(0.0), &SCENE.shoot(&at(0.0), u64::from(frame)));
    }
    let view = View { pinhole: camera(), world_from_camera: at(1e-3) };
    let surfels = bench.model.surfels().unwrap();
    let weight_max = evenly_lit().fusion.weight_max;
    for coloring in [Coloring::Colour, Coloring::Shape, Coloring::Normal, Coloring::Confidence] {
        let live = bench.model.render(&view, coloring, dense::BACKGROUND).unwrap();
        let stored = dense::render_surfels(&bench.gpu, &surfels, &view, (coloring, weight_max)).unwrap();
        assert!(live.depth == stored.depth, "{coloring:?}");
        // Colours are rounded to levels where they are read back.
        let off = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max();
        let worst = live.rgb.pixels().iter().zip(stored.rgb.pixels()).filter_map(off).max();
        assert!(worst <= Some(1), "{coloring:?}: {worst:?}");
    }
}
