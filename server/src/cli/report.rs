//! `mis-slam report`: a page of what replays wrote.

use std::path::{Path, PathBuf};

use clap::Args;
use reporting::RunSource;

use super::progress::Progress;
use super::{Failure, Outcome};
use crate::config::Config;

/// Name of the page inside a run's directory.
const PAGE: &str = "summary.html";
/// Extension of the figures: not `json` alone, as a page `report.html` would take the run's own `report.json`.
const FIGURES: &str = "figures.json";

/// Make one page, and the same figures as JSON beside it, of the directories that `replay` wrote.
///
/// The page holds its pictures in itself. Replay with --save-depth --views-every N for pictures along the way.
#[derive(Debug, Args)]
pub struct Report {
    /// Directories that `replay --out` wrote; of several, the page begins with a comparison.
    #[arg(required = true, value_name = "DIR")]
    directories: Vec<PathBuf>,
    /// The recording with the truth: once for all runs, or once for each in their order. Without it, the recording that
    /// each run names itself is taken where it still is.
    #[arg(long, value_name = "REC.mcap")]
    truth: Vec<PathBuf>,
    /// The page; DIR/summary.html where left out, ./summary.html of several runs.
    #[arg(short, long, value_name = "FILE.html")]
    output: Option<PathBuf>,
}

impl Report {
    pub(super) fn run(self, config: &Config) -> Outcome {
        let sources = self.sources()?;
        let output = self.output.unwrap_or_else(|| match self.directories.as_slice() {
            [directory] => directory.join(PAGE),
            _ => PathBuf::from(PAGE),
        });
        let mut progress = Progress::new("report");
        let total = Some(sources.len() as u64);
        let rendered =
            reporting::report(&sources, &config.recording, &mut |done| progress.set(done as u64, total));
        progress.finish();
        let rendered = rendered.map_err(Failure::bad_input)?;
        let figures = output.with_extension(FIGURES);
        write(&output, &rendered.html)?;
        write(&figures, &rendered.json)?;
        println!("{} and {}", output.display(), figures.display());
        Ok(())
    }

    fn sources(&self) -> Result<Vec<RunSource>, Failure> {
        let (runs, truths) = (self.directories.len(), self.truth.len());
        if truths > 1 && truths != runs {
            let problem =
                format!("--truth is given {truths} times for {runs} runs; once, or once for each run");
            return Err(Failure::bad_input(problem));
        }
        let truth = |index: usize| self.truth.get(index).or(self.truth.first()).cloned();
        let source = |(index, directory): (usize, &PathBuf)| RunSource {
            directory: directory.clone(),
            recording: truth(index),
        };
        Ok(self.directories.iter().enumerate().map(source).collect())
    }
}

fn write(path: &Path, text: &str) -> Outcome {
    std::fs::write(path, text).map_err(|error| Failure::failed(format!("{}: {error}", path.display())))
}
