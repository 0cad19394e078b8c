//! What the surfel stream costs and how exact it is, from one command:
//!
//! `cargo run --release -p tests --bin stream [-- --surfels N] [--frames N] [--out FILE.json]`
//!
//! A synthetic sheet of which every surfel deforms in every frame goes through the real change set on the GPU; what that
//! says is then published at the frame rate through a real server's lanes to WebSocket viewers on loopback, which hold
//! real replicas. `tests/compat/bench_peers.py` measures rerun and Foxglove on as many points beside it.

#![expect(clippy::print_stdout, reason = "what a command prints is its result")]

mod arguments;
mod clock;
mod engine;
mod error;
mod figures;
mod late_join;
mod link;
mod many_viewers;
mod selection;
mod server;
mod sheet;
mod viewer;

use std::process::ExitCode;
use std::sync::Arc;

use arguments::Arguments;
use clap::Parser;
use error::StreamError;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("stream: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), StreamError> {
    let mut figures = figures::Figures::default();
    let run = Arc::new(selection::select(arguments, arguments.surfels, arguments.frames)?);
    figures.selection(&run);
    many_viewers::measure(arguments, &run, &mut figures)?;
    let large = Arc::new(selection::select(arguments, arguments.late_surfels, arguments.late_frames)?);
    late_join::measure(arguments, &large, &mut figures)?;
    figures.print();
    figures.write(&arguments.out)
}
