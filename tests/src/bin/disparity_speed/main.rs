//! What stereo matching costs on one pair, stage by stage:
//!
//! `cargo run -p tests --bin disparity_speed -- LEFT RIGHT [--method M] [--profile P] [--max-disparity N] [--frames N]`
//!
//! The pair is matched over and over by one stage, as a stream is. Prints one line of JSON: CPU time and wall time per
//! frame, the median of each stage on the GPU's clock, dispatches, coverage. `tests/compat/stereo_speed.py` runs OpenCV
//! beside it.

#![expect(clippy::print_stdout, reason = "what a command prints is its result")]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use cpu_time::ProcessTime;
use dense::disparity::{DisparityConfig, DisparityRange, DisparityStage, Method};
use dense::preprocess::Preprocess;
use evaluation::Statistics;
use geometry::Rgb;
use gpu::{FrameRecorder, FrameTimes, Gpu, StageTimer};
use mis_slam::config::{Config, Profile};
use recording::EncodedImage;

/// Passes of one frame, at most.
const STAGES_MAX: u32 = 256;

/// Measures stereo matching of one rectified pair.
#[derive(Debug, Parser)]
struct Arguments {
    /// Left image (PNG or JPEG).
    left: PathBuf,
    /// Right image, of the same size.
    right: PathBuf,
    /// The options that are built in.
    #[arg(long, value_enum, default_value_t = Profile::Default)]
    profile: Profile,
    /// Match by ELAS.
    #[arg(long)]
    elas: bool,
    /// A setting, `section.key=value`; may be repeated.
    #[arg(long = "set")]
    settings: Vec<String>,
    /// Largest disparity searched.
    #[arg(long, default_value_t = 95)]
    max_disparity: i32,
    /// Frames that are measured, after one that is not.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
}

fn main() -> ExitCode {
    match measure(&Arguments::parse()) {
        Ok(figures) => {
            println!("{figures}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("disparity_speed: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure(arguments: &Arguments) -> Result<serde_json::Value, Box<dyn Error>> {
    let config = Config::load_over(arguments.profile, None, &arguments.settings)?;
    let method = if arguments.elas { Method::Elas } else { config.disparity.method };
    let config = (config.gpu, DisparityConfig { method, ..config.disparity });
    let (left, right) = (read(&arguments.left)?, read(&arguments.right)?);
    let gpu = Gpu::open(&config.0.with_environment())?;
    let input = Preprocess::new(&gpu, left.size(), &config.1)?;
    let range = DisparityRange::new(0, arguments.max_disparity)?;
    let disparity = DisparityStage::new(&gpu, &input, range, &config.1)?;
    let timer = StageTimer::new(&gpu, STAGES_MAX)?;
    let frame = || -> Result<FrameTimes, Box<dyn Error>> {
        input.upload(&gpu, &left, &right, None)?;
        let mut frame = FrameRecorder::begin(&gpu, &timer);
        input.record(&mut frame)?;
        disparity.record(&mut frame)?;
        Ok(frame.submit().collect()?)
    };
    let dispatches = frame()?.dispatches;
    let (cpu, wall) = (ProcessTime::now(), Instant::now());
    let times = (0..arguments.frames).map(|_| frame()).collect::<Result<Vec<_>, _>>()?;
    let per_frame = |elapsed: std::time::Duration| 1e3 * elapsed.as_secs_f64() / f64::from(arguments.frames);
    let (cpu_ms, wall_ms) = (per_frame(cpu.elapsed()), per_frame(wall.elapsed()));
    let planes = gpu.read(disparity.planes())?;
    let known = planes.iter().filter(|plane| plane[0] > -1e5).count();
    Ok(serde_json::json!({
        "device": gpu.description().name,
        "size": [left.width(), left.height()],
        "disparities": range.count(),
        "cpu_ms": cpu_ms,
        "wall_ms": wall_ms,
        "dispatches": dispatches,
        "coverage": known as f64 / planes.len() as f64,
        "stages_ms": medians(&times),
    }))
}

/// Milliseconds of each stage in the median frame.
fn medians(times: &[FrameTimes]) -> BTreeMap<&'static str, f64> {
    let mut of_stage: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for frame in times {
        let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
        frame.stages.iter().for_each(|stage| *sums.entry(stage.name).or_default() += stage.ms);
        sums.into_iter().for_each(|(name, ms)| of_stage.entry(name).or_default().push(ms));
    }
    let median = |(name, values)| Some((name, Statistics::of(values)?.median));
    of_stage.into_iter().filter_map(median).collect()
}

fn read(path: &Path) -> Result<Rgb, Box<dyn Error>> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let image = EncodedImage::of_file(bytes);
    let size_px = recording::size_px(&image)?;
    Ok(recording::decode_rgb(&image, size_px)?)
}
