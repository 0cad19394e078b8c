//! The table, on the terminal and as Markdown.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::bound::Figure;
use crate::error::AccuracyError;
use crate::outcome::Outcome;
use crate::rows::Row;

const HEAD: [&str; 7] = ["scene", "figure", "paper", "bound", "ours", "rigid", ""];
const WIDTHS: [usize; 7] = [12, 46, 18, 9, 9, 9, 7];

/// The table as it grows.
pub struct Report {
    directory: PathBuf,
    markdown: String,
    met: usize,
    bounded: usize,
}

impl Report {
    /// An empty table in `directory`.
    pub fn create(directory: &Path) -> Result<Self, AccuracyError> {
        std::fs::create_dir_all(directory).map_err(AccuracyError::io(directory))?;
        let mut report =
            Self { directory: directory.to_path_buf(), markdown: String::new(), met: 0, bounded: 0 };
        report.line(&HEAD.map(str::to_owned));
        report.markdown.push_str("|---|---|---|---|---|---|---|\n");
        Ok(report)
    }

    /// The folder that the table and its pictures are in.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// All figures of a row, beside those of a rigid model where there is one.
    pub fn row(&mut self, row: &Row, outcome: &Outcome, rigid: Option<&Outcome>) {
        for figure in row.figures {
            let rigid = rigid.map_or(String::new(), |rigid| number((figure.value)(rigid)));
            self.figure(row.name, figure, (figure.value)(outcome), rigid);
        }
    }

    fn figure(&mut self, scene: &str, figure: &Figure, ours: Option<f64>, rigid: String) {
        let verdict = self.judge(figure.bound.is_met(ours));
        let [scene, label, anchor] = [scene, figure.label, figure.anchor].map(str::to_owned);
        self.line(&[scene, label, anchor, figure.bound.to_string(), number(ours), rigid, verdict.to_owned()]);
    }

    /// A figure that does not come from one replay.
    pub fn value(&mut self, scene: &str, label: &str, ours: Option<f64>, met: Option<bool>) {
        let verdict = self.judge(met);
        let [scene, label, none, verdict] = [scene, label, "-", verdict].map(str::to_owned);
        self.line(&[scene, label, none.clone(), none, number(ours), String::new(), verdict]);
    }

    fn judge(&mut self, met: Option<bool>) -> &'static str {
        self.bounded += usize::from(met.is_some());
        self.met += usize::from(met == Some(true));
        met.map_or("", |met| if met { "pass" } else { "missed" })
    }

    /// A row that could not be run.
    pub fn skipped(&mut self, scene: &str, why: &str) {
        self.line(&[
            scene.into(),
            format!("skipped: {why}"),
            "".into(),
            "".into(),
            "".into(),
            "".into(),
            "".into(),
        ]);
    }

    fn line(&mut self, cells: &[String; 7]) {
        let padded = cells.iter().zip(WIDTHS).map(|(cell, width)| format!("{cell:<width$}"));
        println!("{}", padded.collect::<Vec<_>>().join("  ").trim_end());
        let _ = writeln!(self.markdown, "| {} |", cells.join(" | "));
    }

    /// Writes `table.md`.
    pub fn finish(self) -> Result<(), AccuracyError> {
        println!(
            "{} of {} figures reached; table and pictures in {}",
            self.met,
            self.bounded,
            self.directory.display()
        );
        let path = self.directory.join("table.md");
        std::fs::write(&path, self.markdown).map_err(AccuracyError::io(&path))
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or("none".into(), |value| format!("{value:.3}"))
}
