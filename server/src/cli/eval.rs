//! `mis-slam eval`: scores of a replay against the truth.

use std::path::PathBuf;

use clap::Args;
use evaluation::Truth;
use recording::RecordingReader;

use super::{Failure, Outcome};
use crate::config::Config;

/// Score what `replay` wrote against the truth in a recording.
#[derive(Debug, Args)]
pub struct Eval {
    /// The directory that `replay --out` wrote.
    directory: PathBuf,
    /// The recording with the truth.
    #[arg(long, value_name = "REC.mcap")]
    truth: PathBuf,
    /// Also write the scores to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Eval {
    pub(super) fn run(&self, config: &Config) -> Outcome {
        let recording = RecordingReader::open(&self.truth, &config.recording).map_err(Failure::bad_input)?;
        let truth = Truth::read(&recording).map_err(Failure::bad_input)?;
        let scores = evaluation::evaluate(&self.directory, &truth).map_err(Failure::bad_input)?;
        let text = serde_json::to_string_pretty(&scores).map_err(Failure::failed)?;
        println!("{text}");
        if let Some(file) = &self.json {
            std::fs::write(file, text + "\n")
                .map_err(|e| Failure::failed(format!("{}: {e}", file.display())))?;
        }
        Ok(())
    }
}
