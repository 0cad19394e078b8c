//! What the command is told.

use std::path::PathBuf;

use clap::Parser;

use crate::error::AccuracyError;
use crate::rows::{self, Row};

/// Name of the figure among the rows.
pub const ROBUSTNESS: &str = "robustness";

/// The accuracy table and the robustness figure of the deformable model.
#[derive(Debug, Parser)]
pub struct Arguments {
    /// Only these rows; may be repeated. Without a name that exists, all names are listed.
    #[arg(long, value_name = "ROW")]
    pub only: Vec<String>,
    /// Frames of each simulated scene.
    #[arg(long, default_value_t = 120, value_parser = clap::value_parser!(u32).range(10..))]
    pub frames: u32,
    /// Columns of each simulated picture; rows are three quarters of them.
    #[arg(long, default_value_t = 640, value_parser = clap::value_parser!(u32).range(64..=1920))]
    pub width: u32,
    /// Also replay every row with a model that never deforms, and print it beside.
    #[arg(long)]
    pub rigid: bool,
    /// One option laid over the row's configuration; may be repeated.
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE")]
    pub overrides: Vec<String>,
    /// Where the table, the figure and the pictures go.
    #[arg(long, default_value = "target/accuracy/report", value_name = "DIR")]
    pub out: PathBuf,
    /// Where recordings and replays are kept.
    #[arg(long, default_value = "target/accuracy/work", value_name = "DIR")]
    pub work: PathBuf,
}

/// What is to be run.
pub struct Wanted {
    pub rows: Vec<Row>,
    pub robustness: bool,
}

impl Arguments {
    /// The rows asked for.
    ///
    /// # Errors
    /// [`AccuracyError::NoSuchRow`] lists those that there are.
    pub fn wanted(&self) -> Result<Wanted, AccuracyError> {
        let all = rows::all();
        let names: Vec<&str> = all.iter().map(|row| row.name).chain([ROBUSTNESS]).collect();
        if let Some(unknown) = self.only.iter().find(|name| !names.contains(&name.as_str())) {
            return Err(AccuracyError::NoSuchRow { name: unknown.clone(), known: names.join(", ") });
        }
        let is_wanted = |name: &str| self.only.is_empty() || self.only.iter().any(|only| only == name);
        let rows = all.into_iter().filter(|row| is_wanted(row.name)).collect();
        Ok(Wanted { rows, robustness: is_wanted(ROBUSTNESS) })
    }

    /// Columns and rows of simulated pictures.
    pub fn size_px(&self) -> (u32, u32) {
        (self.width, self.width * 3 / 4)
    }
}
