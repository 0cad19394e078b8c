//! The command line (design section 10): a contract that scripts depend on.

#![expect(clippy::print_stdout, reason = "what a command prints is its result")]

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::config::{Config, SettingsError};

mod bench;
mod demo;
mod disparity;
mod doctor;
mod eval;
mod import;
pub mod progress;
mod replay;
mod report;
mod serve;
mod simulate;
mod token;

/// Networked reconstruction server for stereo endoscopy.
#[derive(Debug, Parser)]
#[command(name = "mis-slam", version, propagate_version = true, after_help = EXAMPLES)]
pub struct Cli {
    /// A configuration file laid over the defaults of config/server.toml.
    #[arg(long, global = true, value_name = "FILE")]
    config: Option<PathBuf>,
    /// One option, laid over defaults and file; may be repeated.
    #[arg(long = "set", global = true, value_name = "SECTION.KEY=VALUE")]
    overrides: Vec<String>,
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "Examples:
  mis-slam demo                                      a simulated liver, live in the browser
  mis-slam import hamlyn DIR -o rec.mcap             a data set becomes a recording
  mis-slam replay rec.mcap --out run                 a recording becomes a trajectory and a model
  mis-slam eval run --truth rec.mcap                 scores them against the recording's truth
  mis-slam report run                                a page with pictures, plots and figures of a run
  mis-slam bench                                     what this machine can be expected to do
  mis-slam serve                                     the server that scope carts and viewers connect to";

#[derive(Debug, Subcommand)]
enum Verb {
    Serve(serve::Serve),
    Demo(demo::Demo),
    Replay(replay::Replay),
    Report(report::Report),
    Import(import::Import),
    Simulate(simulate::Simulate),
    Disparity(disparity::Disparity),
    Eval(eval::Eval),
    Doctor(doctor::Doctor),
    Bench(bench::Bench),
    Token(token::Token),
}

/// How a verb ends when it does not succeed.
#[derive(Debug)]
pub enum Failure {
    /// The arguments, the configuration or an input cannot be used: exit status 2.
    BadInput(String),
    /// Something else went wrong: exit status 1.
    Failed(String),
}

impl Failure {
    /// Wraps an error about something the user gave.
    pub fn bad_input(error: impl std::fmt::Display) -> Self {
        Self::BadInput(error.to_string())
    }

    /// Wraps any other error.
    pub fn failed(error: impl std::fmt::Display) -> Self {
        Self::Failed(error.to_string())
    }
}

impl From<SettingsError> for Failure {
    fn from(error: SettingsError) -> Self {
        Self::bad_input(error)
    }
}

/// What every verb returns.
pub type Outcome = Result<(), Failure>;

/// Parses the process's arguments, runs the verb, says what went wrong.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let outcome = match crate::telemetry::start(matches!(cli.verb, Verb::Serve(_)), cli.verb.trace()) {
        Err(error) => Err(Failure::bad_input(error)),
        Ok(trace) => cli.run().and(trace.map_or(Ok(()), |trace| trace.finish()).map_err(Failure::failed)),
    };
    let (status, message) = match outcome {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Failed(message)) => (1, message),
        Err(Failure::BadInput(message)) => (2, message),
    };
    eprintln!("mis-slam: {message}");
    ExitCode::from(status)
}

impl Cli {
    fn run(self) -> Outcome {
        let config = Config::load(self.config.as_deref(), &self.overrides)?;
        match self.verb {
            Verb::Serve(verb) => verb.run(&config),
            Verb::Demo(verb) => verb.run(&config),
            Verb::Replay(verb) => verb.run(&config),
            Verb::Report(verb) => verb.run(&config),
            Verb::Import(verb) => verb.run(&config),
            Verb::Simulate(verb) => verb.run(&config),
            Verb::Disparity(verb) => verb.run(&config),
            Verb::Eval(verb) => verb.run(&config),
            Verb::Doctor(verb) => verb.run(&config),
            Verb::Bench(verb) => verb.run(&config, (self.config.as_deref(), &self.overrides)),
            Verb::Token(verb) => verb.run(&config),
        }
    }
}

impl Verb {
    /// Where the verb is to be traced to.
    fn trace(&self) -> Option<&Path> {
        match self {
            Self::Serve(verb) => verb.trace(),
            Self::Replay(verb) => verb.trace(),
            _ => None,
        }
    }
}

/// Columns and rows from a text such as `640x480`.
fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    parsed.ok_or_else(|| format!("{text:?} is no size; write 640x480"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_two_numbers() {
        assert_eq!(parse_size("640x480"), Ok((640, 480)));
        assert!(parse_size("640").is_err() && parse_size("640x-1").is_err() && parse_size("x").is_err());
    }
}
