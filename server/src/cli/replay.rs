//! `mis-slam replay`: a recording in, trajectory and model out.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use clap::Args;

use super::progress::Progress;
use super::{Failure, Outcome};
use crate::config::Config;
use crate::replay::{self, Pace, ReplayOptions, Report};

/// Replay a recording: trajectory, model, depth and a report into a directory.
#[derive(Debug, Args)]
pub struct Replay {
    /// The recording.
    #[arg(value_name = "REC.mcap")]
    recording: PathBuf,
    /// The directory for trajectory.tum, model.ply, model.png, points.csv, depth/ and report.json; `report` makes a page of it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// As fast as possible and lossless, or by the recording's clock as live.
    #[arg(long, value_enum, default_value = "max")]
    pace: Pace,
    /// Also write DIR/depth/NNNNNN.pfm for every pair (metres).
    #[arg(long)]
    save_depth: bool,
    /// Also write DIR/views/NNNNNN.png and .pfm, the model as the scope sees it, for every N-th pair.
    #[arg(long, value_name = "N")]
    views_every: Option<NonZeroU32>,
    /// Also write FEATURES/NNNNNN.png for every pair: the left image with the tracker's features.
    #[arg(long, value_name = "FEATURES")]
    draw_features: Option<PathBuf>,
    /// Also write what each thread and the GPU did when, for ui.perfetto.dev or about:tracing.
    #[arg(long, value_name = "FILE.json")]
    trace: Option<PathBuf>,
}

impl Replay {
    pub(super) fn trace(&self) -> Option<&Path> {
        self.trace.as_deref()
    }

    pub(super) fn run(self, config: &Config) -> Outcome {
        let options = ReplayOptions {
            recording: self.recording,
            out: self.out,
            pace: self.pace,
            save_depth: self.save_depth,
            views_every: self.views_every,
            draw_features: self.draw_features,
        };
        let mut progress = Progress::new("replay");
        let replayed = replay::replay(&options, config, &mut |done, total| progress.set(done, total));
        progress.finish();
        print_summary(&replayed.map_err(failure)?);
        Ok(())
    }
}

fn failure(error: replay::ReplayError) -> Failure {
    if error.is_bad_input() { Failure::bad_input(error) } else { Failure::failed(error) }
}

/// The report's headline, for people.
pub(super) fn print_summary(report: &Report) {
    let frames = &report.frames;
    println!("adapter          {}", report.adapter);
    println!(
        "pairs            {} paired, {} tracked, {} lost, {} fused, {} discarded, {} dropped",
        frames.paired, frames.tracked, frames.lost, frames.fused, frames.discarded, frames.dropped
    );
    for (reason, count) in &report.reasons {
        println!("                 {count} {reason}");
    }
    if report.truncated {
        println!("                 the recording is truncated; replayed up to its last good record");
    }
    let back_projection = &report.back_projection_mm;
    println!(
        "back-projection  median {:.3} mm, rmse {:.3} mm, coverage {:.1} %",
        back_projection.median,
        back_projection.rmse,
        100.0 * back_projection.coverage
    );
    println!("model            {} surfels", report.surfels);
    println!("frame            median {:.0} ms, p95 {:.0} ms", report.frame_ms.median, report.frame_ms.p95);
    println!("wall             {:.1} s", report.wall_s);
}
