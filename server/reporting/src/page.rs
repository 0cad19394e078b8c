//! The page: what its templates show, and the same as JSON.

mod plots;
mod tables;

use askama::Template;
use serde_json::{Value, json};

use crate::ReportingError;
use crate::frames::{self, FrameView};
use crate::paper::{self, PaperRow};
use crate::picture::{Picture, read_png};
use crate::planes;
use crate::run::Run;
use crate::truth::Known;
use plots::Plot;
use tables::{Comparison, Fact, StageRow};

/// All runs of a report.
#[derive(Default)]
pub(crate) struct Page {
    runs: Vec<RunView>,
    json: Vec<Value>,
}

#[derive(Template)]
#[template(path = "page.html")]
struct PageTemplate<'a> {
    runs: &'a [RunView],
    comparison: Option<Comparison>,
}

/// One run as the page shows it.
struct RunView {
    /// For links within the page.
    anchor: String,
    name: String,
    recording: String,
    facts: Vec<Fact>,
    missing: Vec<String>,
    overview: Option<Picture>,
    frames: Vec<FrameView>,
    trajectory: Vec<Plot>,
    errors: Vec<Plot>,
    planes: Vec<Picture>,
    planes_of: String,
    stages: Vec<StageRow>,
    stream: Vec<Fact>,
    stream_plot: Option<Plot>,
    paper: Vec<PaperRow>,
    scores: Vec<Fact>,
    /// Of the comparison.
    summary: Vec<Fact>,
}

impl Page {
    /// Adds a run, with everything that is drawn of it.
    pub fn add(&mut self, run: &Run, known: &Known) -> Result<(), ReportingError> {
        let missing = missing(run, known);
        let paper = paper::rows(&run.figures, known);
        self.json.push(json!({
            "name": run.name,
            "recording": known.name,
            "missing": missing,
            "report": run.raw,
            "scores": known.scores,
            "paper": paper,
        }));
        let planes = known.surfaces.as_ref().map(planes::pictures).transpose()?.unwrap_or_default();
        let overview = run.overview().map(|path| Picture::new("the whole model".into(), &read_png(&path)?));
        self.runs.push(RunView {
            anchor: format!("run-{}", self.runs.len() + 1),
            name: run.name.clone(),
            recording: tables::provenance(known),
            facts: tables::facts(&run.figures),
            missing,
            overview: overview.transpose()?,
            frames: frames::frames(run, known)?,
            trajectory: plots::trajectory(run, known)?,
            errors: plots::errors(run)?,
            planes,
            planes_of: known.surfaces.as_ref().map(tables::planes_of).unwrap_or_default(),
            stages: tables::stages(&run.figures),
            stream: tables::stream(&run.figures),
            stream_plot: plots::stream(run)?,
            paper,
            scores: tables::scores(known),
            summary: tables::summary(&run.figures, known),
        });
        Ok(())
    }

    /// The document.
    pub fn html(&self) -> Result<String, ReportingError> {
        let comparison = (self.runs.len() > 1).then(|| Comparison::of(&self.runs));
        Ok(PageTemplate { runs: &self.runs, comparison }.render()?)
    }

    /// The figures.
    pub fn json(&self) -> String {
        let text = serde_json::to_string_pretty(&json!({ "runs": self.json }));
        text.expect("figures have string keys") + "\n"
    }
}

/// What the page cannot show, and what would bring it.
fn missing(run: &Run, known: &Known) -> Vec<String> {
    let parts = [
        (run.views.is_empty(), "pictures of the model along the way: replay with --views-every N"),
        (run.depths.is_empty(), "depth and residual images: replay with --save-depth"),
        (run.trajectory.is_none(), "trajectory.tum: the trajectory"),
        (run.frames.is_none(), "frames.csv: errors frame by frame"),
        (run.tracking.is_none(), "tracking.csv: matches frame by frame"),
        (run.stream.is_none(), "stream.csv: bytes epoch by epoch"),
        (run.figures.stream.is_none(), "report.json, stream: the cost of streaming"),
        (run.overview().is_none(), "model.png: the picture of the whole model"),
    ];
    let mut missing: Vec<String> =
        parts.into_iter().filter(|(is_missing, _)| *is_missing).map(|(_, what)| what.to_owned()).collect();
    if let Some(why) = &known.absent {
        missing.push(format!("the recording, and all that it holds of the truth: {why} (--truth names it)"));
    }
    if let Some(scores) = &known.scores {
        missing.extend(scores.missing.iter().map(|what| format!("for scores: {what}")));
    }
    missing
}
