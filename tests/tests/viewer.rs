//! Pictures that the server draws, and what the native viewer shows: one model, seen from one place.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;
use std::process::{Child, Command};
use std::time::Instant;

use geometry::Rgb;
use recording::{ImageFormat, export};
use serde_json::{Value, json};
use tests::display::VirtualDisplay;
use tests::server::{PATIENCE, Server, stored_in};
use tests::{data, process};

const SIZE: (u32, u32) = (320, 240);
/// Small pictures: the tests run on software Vulkan.
const SMALL: &[&str] = &["--size", "320x240", "--frames", "16", "--fps", "10", "--rigid"];
const BACKGROUND: [u8; 3] = [18, 18, 22];
/// As the first camera saw it, and from the side.
const POSES: [&str; 2] = ["0,0,0,0,0,0,1", "0.02,-0.03,-0.01,0.1,0.1,0,0.98995"];
const SESSION: &str = "/api/sessions/liver";

/// A server that has worked a recording through and holds its model.
fn with_model(scratch: &Path) -> Server {
    let server = Server::start(&[&stored_in(&scratch.join("data"))]);
    work_through(&server, scratch);
    server
}

fn work_through(server: &Server, scratch: &Path) {
    let recordings = scratch.join("data/recordings");
    std::fs::create_dir_all(&recordings).unwrap();
    std::fs::rename(data::simulate(scratch, "liver", SMALL), recordings.join("liver.mcap")).unwrap();
    server.post(
        "/api/sessions",
        &json!({"session": "liver", "replay": {"recording": "liver.mcap", "rate": 0.0}}),
    );
    server.wait_for(SESSION, |state| {
        let dropped: u64 = state["drops"].as_object()?.values().filter_map(Value::as_u64).sum();
        let done = state["frames_fused"].as_u64()? + dropped >= state["pairs_received"].as_u64()?;
        (done && state["replay"]["ended"] == true).then_some(())
    });
    server.wait_until_still(SESSION);
}

fn decoded(png: Vec<u8>, size: (u32, u32)) -> Rgb {
    let image = recording::EncodedImage { format: ImageFormat::Png, bytes: png };
    recording::decode_rgb(&image, size).unwrap()
}

fn from_server(server: &Server, base: &str, pose: &str, more: &str) -> Rgb {
    let (width, height) = SIZE;
    let query = format!("width={width}&height={height}&pose={pose}&opening_deg=60{more}");
    decoded(server.get_bytes(&format!("{base}/view.png?{query}")), SIZE)
}

fn viewer(to: &str, pose: &str) -> Command {
    let mut command = process::program("mis-slam-view");
    command.args(["--to", to, "--session", "liver", "--plain", "--size", "320x240"]);
    command.args(["--opening-deg", "60", "--pose", pose]);
    command
}

/// How alike two pictures of a model are.
#[derive(Debug)]
struct Likeness {
    /// Pixels that show the model in both, of those that show it in either.
    overlap: f64,
    /// Mean difference of levels where both show it.
    levels: f64,
    /// Share of the picture that the first one's model covers.
    coverage: f64,
}

fn likeness(a: &Rgb, b: &Rgb) -> Likeness {
    let pairs = || a.pixels().iter().zip(b.pixels());
    let both: Vec<_> = pairs().filter(|(a, b)| **a != BACKGROUND && **b != BACKGROUND).collect();
    let either = pairs().filter(|(a, b)| **a != BACKGROUND || **b != BACKGROUND).count();
    let off = |(a, b): &(&[u8; 3], &[u8; 3])| -> u32 {
        a.iter().zip(*b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
    };
    let sum: u32 = both.iter().map(off).sum();
    Likeness {
        overlap: both.len() as f64 / either.max(1) as f64,
        levels: f64::from(sum) / 3.0 / both.len().max(1) as f64,
        coverage: a.pixels().iter().filter(|pixel| **pixel != BACKGROUND).count() as f64
            / a.pixels().len() as f64,
    }
}

/// The server splats discs in a compute shader, the viewer draws triangles of what came over the network, half as large
/// again to close gaps: measured, the overlap is 0.97 at least and levels differ by 9 at most, where lit tissue is
/// brighter than a level can say.
fn assert_alike(what: &str, server: &Rgb, viewer: &Rgb) {
    let found = likeness(server, viewer);
    eprintln!("{what}: {found:?}");
    assert!(found.coverage > 0.1 && found.overlap > 0.95 && found.levels < 12.0, "{what}: {found:?}");
}

#[test]
fn the_viewer_draws_the_model_that_the_server_draws_over_both_transports() {
    let scratch = tempfile::tempdir().unwrap();
    let server = with_model(scratch.path());
    for (pose, to) in POSES.into_iter().zip([server.ws(), format!("zenoh/{}", server.zenoh)]) {
        let file = scratch.path().join("viewer.png");
        let mut command = viewer(&to, pose);
        process::run({
            command.args(["--headless", "--screenshot"]).arg(&file);
            command
        });
        let expected = from_server(&server, SESSION, pose, "");
        assert_alike(&to, &expected, &decoded(std::fs::read(&file).unwrap(), SIZE));
    }
}

#[test]
fn the_files_of_an_open_session_hold_what_those_of_the_finished_one_do() {
    let scratch = tempfile::tempdir().unwrap();
    let server = with_model(scratch.path());
    let file = |base: &str, name: &str| {
        let path = scratch.path().join(name);
        std::fs::write(&path, server.get_bytes(&format!("{base}/{name}"))).unwrap();
        path
    };
    let model = |base: &str| export::read_ply(&file(base, "model.ply")).unwrap();
    let way = |base: &str| export::read_tum(&file(base, "trajectory.tum")).unwrap();
    let open = (model(SESSION), way(SESSION));
    server.delete(SESSION);
    let run = server.get("/api/finished")[0]["run"].as_str().expect("a finished run").to_owned();
    let base = format!("/api/finished/{run}");
    let finished = (model(&base), way(&base));
    assert!(open.0.len() > 100 && open.0 == finished.0, "{} {}", open.0.len(), finished.0.len());
    assert!(open.1.len() > 4 && open.1.len() == finished.1.len(), "{} {}", open.1.len(), finished.1.len());
    for (open, finished) in open.1.iter().zip(&finished.1) {
        assert_eq!(open.stamp_ns, finished.stamp_ns);
        let apart = open.world_from_camera.inv_mul(&finished.world_from_camera);
        // Both are printed with nine digits.
        assert!(apart.translation.vector.norm() < 1e-8 && apart.rotation.angle() < 1e-7, "{apart}");
    }
}

#[test]
fn a_finished_session_gives_the_pictures_that_it_gave_while_it_was_open() {
    let scratch = tempfile::tempdir().unwrap();
    let server = with_model(scratch.path());
    let colorings = ["colour", "shape", "normal", "confidence"].map(|name| format!("&coloring={name}"));
    let open = colorings.each_ref().map(|coloring| from_server(&server, SESSION, POSES[1], coloring));
    let overview = server.get_bytes(&format!("{SESSION}/view.png"));
    let scope = server.get_bytes(&format!("{SESSION}/view.png?from=scope"));
    for png in [overview, scope] {
        let shown = decoded(png, (640, 480));
        assert!(likeness(&shown, &shown).coverage > 0.1);
    }
    server.delete(SESSION);
    let run = server.get("/api/finished")[0]["run"].as_str().expect("a finished run").to_owned();
    for (coloring, open) in colorings.iter().zip(&open) {
        let finished = from_server(&server, &format!("/api/finished/{run}"), POSES[1], coloring);
        // A stored colour is a level; on the GPU, lit tissue may be brighter.
        let found = likeness(open, &finished);
        eprintln!("{coloring}: {found:?}");
        assert!(found.coverage > 0.1 && found.overlap > 0.999 && found.levels < 1.0, "{coloring}: {found:?}");
    }
}

/// Ended when dropped.
struct Window(Child);

impl Drop for Window {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_window_shows_the_model() {
    let Some(display) = VirtualDisplay::start(SIZE) else { return };
    let scratch = tempfile::tempdir().unwrap();
    let server = with_model(scratch.path());
    let expected = from_server(&server, SESSION, POSES[0], "");
    let mut command = viewer(&server.ws(), POSES[0]);
    command.env("DISPLAY", &display.name).env_remove("WAYLAND_DISPLAY");
    let mut window = Window(command.spawn().unwrap());
    let started = Instant::now();
    loop {
        let shown = display.picture();
        if shown.size() == SIZE && likeness(&expected, &shown).overlap > 0.8 {
            break assert_alike("window", &expected, &shown);
        }
        assert!(window.0.try_wait().unwrap().is_none(), "the viewer has ended");
        assert!(started.elapsed() < PATIENCE, "{:?}", likeness(&expected, &shown));
        std::thread::park_timeout(std::time::Duration::from_millis(100));
    }
}

#[test]
fn a_server_with_a_window_draws_the_model_from_where_it_lives() {
    let size = (1280, 960);
    let Some(display) = VirtualDisplay::start(size) else { return };
    let scratch = tempfile::tempdir().unwrap();
    let mut server = Server::start_with_window(&display.name, &[&stored_in(&scratch.path().join("data"))]);
    work_through(&server, scratch.path());
    let expected = decoded(server.get_bytes(&format!("{SESSION}/view.png?width=1280&height=960")), size);
    // The window keeps its place while the model grows by less than a tenth, so the two are not seen from one point.
    let found = likeness(&expected, &display.picture());
    assert!(found.coverage > 0.1 && found.overlap > 0.6, "{found:?}");
    assert!(server.terminate().success());
}
