//! Measures the tracker alone, without a GPU, against the figures that it must reach.
//!
//! ```text
//! cargo run -p tracking-evaluation                 # every row
//! cargo run -p tracking-evaluation -- --only d4d   # rows whose name contains a text
//! ```
//!
//! Each row is printed with its target, what comparable systems reach, and `pass` or `missed`. Simulated recordings are
//! kept in `target/tracking-evaluation`; rows that need `../shared/data` say that they are skipped where it is absent. Exit
//! status 1: a figure was missed.

#![expect(clippy::print_stdout, reason = "the table goes to standard output")]

mod deformation;
mod disturbances;
mod endoscopes;
mod footage;
mod perfect;
mod resources;
mod row;
mod run;
mod settings;
mod simulated;

use std::process::ExitCode;

use clap::Parser;

use footage::Footage;
use row::{Row, Verdict};
use settings::Settings;

/// What may go wrong; the row that it happens in ends the run.
pub type Error = Box<dyn std::error::Error>;

#[derive(Parser)]
#[command(about = "Measure the tracker against its figures")]
struct Arguments {
    /// Only rows whose name contains this.
    #[arg(long)]
    only: Option<String>,
    /// Single values over config/server.toml, `section.key=value`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Print the memory that a tracker holds after this many frames of `--of`, and end.
    #[arg(long, value_name = "FRAMES", requires = "of")]
    resident_after: Option<usize>,
    /// The recording for `--resident-after`, begun again whenever it ends.
    #[arg(long, value_name = "REC.mcap")]
    of: Option<std::path::PathBuf>,
}

fn main() -> Result<ExitCode, Error> {
    let arguments = Arguments::parse();
    let settings = Settings::load(&arguments.overrides)?;
    if let (Some(frames), Some(recording)) = (arguments.resident_after, &arguments.of) {
        println!("{}", resources::resident_mib_after(frames, recording, &settings)?);
        return Ok(ExitCode::SUCCESS);
    }
    let footage = Footage::new(&settings)?;
    let wanted = |row: &Row| arguments.only.as_ref().is_none_or(|text| row.name.contains(text));
    let mut missed = 0;
    println!("{}", Row::heading());
    for row in rows().into_iter().filter(wanted) {
        let measured = (row.measure)(&footage, &settings)?;
        missed += usize::from(measured.verdict == Verdict::Missed);
        println!("{}", row.line(&measured));
    }
    Ok(ExitCode::from(u8::from(missed > 0)))
}

fn rows() -> Vec<Row> {
    let mut rows = resources::time_rows();
    rows.extend(simulated::rows());
    rows.extend(deformation::rows());
    rows.extend(disturbances::rows());
    rows.extend(endoscopes::rows());
    rows.extend(resources::memory_rows());
    rows
}
