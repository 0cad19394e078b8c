//! One replay and its scores.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use evaluation::Truth;
use mis_slam::cli::progress::Progress;
use mis_slam::config::Config;
use mis_slam::replay::{self, Pace, ReplayOptions};
use recording::RecordingReader;

use crate::arguments::Arguments;
use crate::error::AccuracyError;
use crate::outcome::Outcome;
use crate::rows::Row;
use crate::view_depth;

/// Every how many pairs the model is pictured.
const VIEWS_EVERY: NonZeroU32 = NonZeroU32::new(5).expect("five is not zero");
/// Turns the warp off.
const RIGID: &str = "dense.warp.enabled=false";

/// A replay's folder and figures.
pub struct Replayed {
    pub directory: PathBuf,
    pub outcome: Outcome,
}

/// Replays a row's recording with the row's configuration.
pub fn run(row: &Row, recording: &Path, arguments: &Arguments) -> Result<Replayed, AccuracyError> {
    run_with(row, recording, arguments, (row.name.to_owned(), &[]))
}

/// The same with a model that never deforms.
pub fn run_rigid(row: &Row, recording: &Path, arguments: &Arguments) -> Result<Replayed, AccuracyError> {
    run_with(row, recording, arguments, (format!("{}-rigid", row.name), &[RIGID]))
}

fn run_with(
    row: &Row,
    recording: &Path,
    arguments: &Arguments,
    (name, more): (String, &[&str]),
) -> Result<Replayed, AccuracyError> {
    let mut overrides: Vec<String> = row.overrides.iter().chain(more).map(|&text| text.to_owned()).collect();
    overrides.extend(arguments.overrides.iter().cloned());
    let config = Config::load(row.profile_path().as_deref(), &overrides)?;
    let directory = arguments.work.join(name);
    let report = replay(recording, &directory, &config)?;
    let reader = RecordingReader::open(recording, &config.recording)?;
    let scores = evaluation::evaluate(&directory, &Truth::read(&reader)?)?;
    let mut outcome = Outcome::of(&directory, scores, report)?;
    if let Some((first, last)) = row.view_depth_frames {
        let frames = first..=last;
        outcome.view_depth_rmse_mm = view_depth::rmse_mm(&directory.join("views"), &reader, &frames)?;
        outcome.measured_depth_rmse_mm = view_depth::rmse_mm(&directory.join("depth"), &reader, &frames)?;
    }
    Ok(Replayed { directory, outcome })
}

/// Replays into an empty folder.
pub fn replay(recording: &Path, directory: &Path, config: &Config) -> Result<replay::Report, AccuracyError> {
    if directory.exists() {
        std::fs::remove_dir_all(directory).map_err(AccuracyError::io(directory))?;
    }
    let options = ReplayOptions {
        recording: recording.to_path_buf(),
        out: directory.to_path_buf(),
        pace: Pace::Max,
        save_depth: true,
        views_every: Some(VIEWS_EVERY),
        draw_features: None,
    };
    let mut progress = Progress::new("replay");
    let report = replay::replay(&options, config, &mut |done, total| progress.set(done, total))?;
    progress.finish();
    Ok(report)
}
