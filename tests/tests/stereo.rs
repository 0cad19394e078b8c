//! `mis-slam disparity` on pairs whose disparity is known.
#![expect(clippy::unwrap_used, reason = "a test ends at what it does not expect")]

use std::path::Path;
use std::process::Command;

use geometry::{Raster, Rgb};
use recording::export::read_pfm;
use tests::data::shared_data;
use tests::process::{described, program, run, run_any};

const PAIR: u32 = 10;

fn disparity(left: &Path, right: &Path, out: &Path) -> Command {
    let mut command = program("mis-slam");
    command.arg("disparity").args([left, right]).arg("-o").arg(out).args(["--max-disparity", "254"]);
    command
}

fn read_image(path: &Path) -> Rgb {
    let bytes = std::fs::read(path).unwrap();
    let image = recording::EncodedImage { format: recording::ImageFormat::Png, bytes };
    recording::decode_rgb(&image, recording::size_px(&image).unwrap()).unwrap()
}

fn write_image(path: &Path, image: &Rgb) {
    std::fs::write(path, recording::encode_png_rgb(image).unwrap().bytes).unwrap();
}

/// Disparity of the rendered pair: Z = round(G 100/255) + R/255 scene units, f B = 260.
fn truth(path: &Path) -> Raster<f64> {
    let image = read_image(path);
    Raster::from_fn(image.width(), image.height(), |x, y| {
        let [red, green, _] = image[(x, y)].map(f64::from);
        260.0 / ((green * 100.0 / 255.0).round() + red / 255.0)
    })
}

/// Share of the matched pixels that are more than a pixel off.
fn share_off(found: &Raster<f32>, truth: &Raster<f64>) -> f64 {
    let errors = found.pixels().iter().zip(truth.pixels()).filter(|(found, _)| found.is_finite());
    let errors: Vec<f64> = errors.map(|(found, truth)| (f64::from(*found) - truth).abs()).collect();
    errors.iter().filter(|error| **error > 1.0).count() as f64 / errors.len() as f64
}

#[test]
fn rows_two_pixels_off_are_levelled_and_cost_little() {
    let Some(data) = shared_data("bdis_synth/30") else { return };
    let scratch = tempfile::tempdir().unwrap();
    let left = data.join(format!("left/{PAIR}.png"));
    let right = data.join(format!("right/{PAIR}.png"));
    let truth = truth(&data.join(format!("depth_rg/depth_{PAIR:07}.png")));
    let level = scratch.path().join("level.pfm");
    run(disparity(&left, &right, &level));
    let image = read_image(&right);
    let lower = Rgb::from_fn(image.width(), image.height(), |x, y| image[(x, y.saturating_sub(2))]);
    let shifted = scratch.path().join("shifted.png");
    write_image(&shifted, &lower);
    let out = scratch.path().join("shifted.pfm");
    let output = run(disparity(&left, &shifted, &out));
    assert!(described(&output).contains("rows levelled"), "{}", described(&output));
    let off = |pfm: &Path| share_off(&read_pfm(pfm).unwrap(), &truth);
    let (before, after) = (off(&level), off(&out));
    assert!(after < 1.15 * before, "{before} off level, {after} with rows 2 px apart");
}

#[test]
fn swapped_eyes_are_refused_by_name_and_pictures_are_written_on_request() {
    let Some(data) = shared_data("bdis_synth/32") else { return };
    let scratch = tempfile::tempdir().unwrap();
    let (left, right) = (data.join("left/1.png"), data.join("right/1.png"));
    let out = scratch.path().join("out.pfm");
    let refused = run_any(disparity(&right, &left, &out));
    assert_eq!(refused.status.code(), Some(2), "{}", described(&refused));
    assert!(described(&refused).contains("left and right eye are swapped"), "{}", described(&refused));
    assert!(!out.exists());
    let mut accepted = disparity(&left, &right, &out);
    accepted.arg("--png");
    run(accepted);
    for name in ["out.png", "out.sigma.png"] {
        assert_eq!(read_image(&scratch.path().join(name)).size(), (640, 480), "{name}");
    }
}
