//! Tracks a folder of rectified image pairs and prints the trajectory.
//!
//! ```text
//! cargo run -p tracking --example track_folder -- DIR --focal-px 520 --centre-px 319.5 239.5 --baseline-mm 5
//! ```
//!
//! `DIR/left` and `DIR/right` hold PNG or JPEG files of the same names (`--left`, `--right` name other folders), taken in the
//! order of the numbers in their names; `--masks NAME` adds instrument masks. Standard output gets a pose per
//! tracked frame (`t tx ty tz qx qy qz qw`, `world_from_camera`, metres), standard error a line per frame and the mean times.

#![expect(clippy::print_stdout, reason = "the trajectory goes to standard output")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Parser;
use geometry::{Gray, Pinhole, Pose, Raster, StereoRig};
use tracking::{Outcome, StereoFrame, Tracker, TrackingConfig, TrackingReport};

type Error = Box<dyn std::error::Error>;

#[derive(Parser)]
struct Arguments {
    /// Folder with the two image folders.
    folder: PathBuf,
    /// Name of the left image folder.
    #[arg(long, default_value = "left")]
    left: String,
    /// Name of the right image folder.
    #[arg(long, default_value = "right")]
    right: String,
    /// Name of a folder with masks, not zero where instruments are.
    #[arg(long)]
    masks: Option<String>,
    /// Focal length of the rectified images.
    #[arg(long)]
    focal_px: f64,
    /// Principal point, x and y.
    #[arg(long, num_args = 2, value_names = ["X", "Y"])]
    centre_px: Vec<f64>,
    /// Distance of the optical centres.
    #[arg(long)]
    baseline_mm: f64,
    /// Frames per second.
    #[arg(long, default_value_t = 30.0)]
    fps: f64,
    /// Configuration with a section `[tracking]`.
    #[arg(long, default_value = "config/server.toml")]
    config: PathBuf,
}

fn main() -> Result<(), Error> {
    let arguments = Arguments::parse();
    let left_folder = arguments.folder.join(&arguments.left);
    let names = image_names(&left_folder)?;
    let first = read_gray(&left_folder.join(names.first().ok_or("no images")?))?;
    let mut tracker = Tracker::new(&read_config(&arguments.config)?, &rig(&arguments, first.size()))?;
    let mut busy = Duration::ZERO;
    let mut tracked = 0;
    for (index, name) in names.iter().enumerate() {
        let left = read_gray(&left_folder.join(name))?;
        let right = read_gray(&arguments.folder.join(&arguments.right).join(name))?;
        let mask = arguments.masks.as_ref().and_then(|masks| read_mask(&arguments.folder.join(masks), name));
        let stamp_ns = 1_000_000_000 + (index as f64 * 1e9 / arguments.fps).round() as u64;
        let started = Instant::now();
        let report =
            tracker.track(&StereoFrame { stamp_ns, left: &left, right: &right, mask: mask.as_ref() })?;
        let elapsed = started.elapsed();
        busy += elapsed;
        tracked += usize::from(report.world_from_camera.is_some());
        print_frame(name, stamp_ns, &report, elapsed);
    }
    let mean_ms = busy.as_secs_f64() * 1e3 / names.len() as f64;
    eprintln!("tracked {tracked} of {}, {mean_ms:.1} ms per frame", names.len());
    Ok(())
}

fn rig(arguments: &Arguments, (width_px, height_px): (u32, u32)) -> StereoRig {
    let (fx_px, fy_px) = (arguments.focal_px, arguments.focal_px);
    let (cx_px, cy_px) = (arguments.centre_px[0], arguments.centre_px[1]);
    let left = Pinhole { width_px, height_px, fx_px, fy_px, cx_px, cy_px };
    StereoRig { left, baseline_m: arguments.baseline_mm / 1e3, right_cx_px: cx_px }
}

fn read_config(path: &Path) -> Result<TrackingConfig, Error> {
    let mut file: toml::Table = std::fs::read_to_string(path)?.parse()?;
    Ok(file.remove("tracking").ok_or("no section [tracking]")?.try_into()?)
}

/// File names in the order of the numbers in them.
fn image_names(folder: &Path) -> Result<Vec<String>, Error> {
    let mut names: Vec<String> = std::fs::read_dir(folder)?
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".png") || name.ends_with(".jpg"))
        .collect();
    let number = |name: &String| {
        let digits: String = name.chars().filter(char::is_ascii_digit).collect();
        digits.parse::<u64>().unwrap_or(u64::MAX)
    };
    names.sort_by_key(|name| (number(name), name.clone()));
    Ok(names)
}

/// Luminance as the server computes it.
fn read_gray(path: &Path) -> Result<Gray, Error> {
    let rgb = image::open(path)?.into_rgb8();
    let (width, height) = rgb.dimensions();
    let pixels = rgb.into_raw().chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Ok(Raster::from_vec(width, height, pixels)?.to_gray())
}

/// Masks are PNG whatever the images are; a frame may have none.
fn read_mask(folder: &Path, image_name: &str) -> Option<Gray> {
    read_gray(&folder.join(image_name).with_extension("png")).ok()
}

fn print_frame(name: &str, stamp_ns: u64, report: &TrackingReport, elapsed: Duration) {
    if let Some(Pose { translation, rotation }) = &report.world_from_camera {
        let (seconds, nanoseconds) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
        let (t, q) = (translation.vector, rotation.coords);
        println!("{seconds}.{nanoseconds:09} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    let counts = &report.statistics;
    let state = match report.outcome {
        Outcome::NotInitialized => "waiting",
        Outcome::Tracked => "tracked",
        Outcome::Recovered => "recovered",
        Outcome::Lost { .. } => "lost",
    };
    eprintln!(
        "{name} {state} {:?}: {} left, {} right, {} stereo; {} inliers of {} found of {} searched; \
         {} keyframes {:?}, {} points; {:.1} ms",
        report.source,
        counts.left_features,
        counts.right_features,
        counts.stereo_points,
        counts.inliers,
        counts.matches,
        counts.searched_points,
        counts.keyframes,
        report.keyframe,
        counts.map_points,
        elapsed.as_secs_f64() * 1e3,
    );
}
