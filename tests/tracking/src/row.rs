//! A figure to reach, and how it is printed.

use crate::Error;
use crate::footage::Footage;
use crate::settings::Settings;

/// One line of the table.
pub struct Row {
    /// Short, unique.
    pub name: &'static str,
    /// What must be reached.
    pub target: &'static str,
    /// What comparable systems reach.
    pub anchor: &'static str,
    /// Takes the measurement.
    pub measure: fn(&Footage, &Settings) -> Result<Measured, Error>,
}

/// Whether a figure was reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It was.
    Pass,
    /// It was not.
    Missed,
    /// Nothing to measure it on.
    Skipped,
}

/// What a row found.
pub struct Measured {
    /// The figure, for people.
    pub text: String,
    /// Whether it suffices.
    pub verdict: Verdict,
}

impl Measured {
    /// A figure and whether it suffices.
    pub fn new(text: String, suffices: bool) -> Self {
        Self { text, verdict: if suffices { Verdict::Pass } else { Verdict::Missed } }
    }

    /// There is nothing to measure on.
    pub fn skipped(what: &str) -> Self {
        Self { text: format!("{what} is not on this machine"), verdict: Verdict::Skipped }
    }
}

impl Row {
    /// Names of the columns.
    pub fn heading() -> String {
        "| row | verdict | measured | target | anchor |\n|---|---|---|---|---|".into()
    }

    /// The row as a line of a Markdown table.
    pub fn line(&self, measured: &Measured) -> String {
        let verdict = match measured.verdict {
            Verdict::Pass => "pass",
            Verdict::Missed => "missed",
            Verdict::Skipped => "skipped",
        };
        format!("| {} | {verdict} | {} | {} | {} |", self.name, measured.text, self.target, self.anchor)
    }
}
