//! The accuracy table and the robustness figure of the deformable model, from one command:
//!
//! `cargo run --release -p tests --bin accuracy [-- --only ROW] [--frames N] [--rigid]`
//!
//! Each row replays one recording with the shipped configuration and profile, scores it against the truth and prints
//! every figure with its bound and the paper's. Recordings are made once and kept; replays are always made anew.

#![expect(clippy::print_stdout, reason = "what a command prints is its result")]

mod arguments;
mod bound;
mod error;
mod outcome;
mod pictures;
mod recordings;
mod replays;
mod report;
mod robustness;
mod rows;
mod view_depth;

use std::process::ExitCode;

use arguments::Arguments;
use clap::Parser;
use error::AccuracyError;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("accuracy: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), AccuracyError> {
    let wanted = arguments.wanted()?;
    let mut report = report::Report::create(&arguments.out)?;
    for row in wanted.rows {
        let Some(recording) = recordings::provide(&row.recording, arguments)? else {
            report.skipped(row.name, "its recording is not on this machine");
            continue;
        };
        let result = replays::run(&row, &recording, arguments)?;
        pictures::keep(&result.directory, row.name, &arguments.out)?;
        let rigid = (row.beside_rigid || arguments.rigid)
            .then(|| replays::run_rigid(&row, &recording, arguments))
            .transpose()?;
        report.row(&row, &result.outcome, rigid.as_ref().map(|rigid| &rigid.outcome));
    }
    if wanted.robustness {
        robustness::run(arguments, &mut report)?;
    }
    report.finish()
}
