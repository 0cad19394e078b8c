//! What a replay wrote.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use geometry::DepthMap;
use geometry::trajectory::StampedPose;
use recording::export;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::ReportingError;
use crate::figures::Figures;

/// A run's directory, read but for its pictures.
pub(crate) struct Run {
    pub directory: PathBuf,
    pub name: String,
    pub figures: Figures,
    /// All of `report.json`.
    pub raw: Value,
    pub trajectory: Option<Vec<StampedPose>>,
    pub frames: Option<Vec<FrameRow>>,
    pub tracking: Option<Vec<TrackingRow>>,
    pub stream: Option<Vec<StreamRow>>,
    /// Pictures of the model, by the pair's number.
    pub views: BTreeMap<u64, PathBuf>,
    /// Depth of the model in the same views.
    pub view_depths: BTreeMap<u64, PathBuf>,
    /// Measured depth.
    pub depths: BTreeMap<u64, PathBuf>,
}

/// A line of `frames.csv`.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct FrameRow {
    pub frame: u64,
    pub mean_mm: Option<f64>,
    pub p95_mm: Option<f64>,
}

/// A line of `tracking.csv`.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct TrackingRow {
    pub frame: u64,
    pub matches: u64,
    pub inliers: u64,
}

/// A line of `stream.csv`.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct StreamRow {
    pub epoch: u64,
    pub bytes: u64,
}

impl Run {
    /// Reads the directory that a replay wrote.
    ///
    /// # Errors
    /// [`ReportingError::NoRun`] without `report.json`; any file that is damaged, by its name. What is merely absent is
    /// `None` or empty.
    pub fn read(directory: &Path) -> Result<Self, ReportingError> {
        let raw = read_report(&directory.join("report.json"))?;
        let figures = Figures::deserialize(&raw)
            .map_err(|error| ReportingError::damaged(&directory.join("report.json"), error))?;
        let trajectory = existing(directory, "trajectory.tum");
        Ok(Self {
            directory: directory.to_path_buf(),
            name: crate::name_of(directory),
            figures,
            raw,
            trajectory: trajectory.map(|path| export::read_tum(&path)).transpose()?,
            frames: read_rows(directory, "frames.csv")?,
            tracking: read_rows(directory, "tracking.csv")?,
            stream: read_rows(directory, "stream.csv")?,
            views: numbered(&directory.join("views"), "png")?,
            view_depths: numbered(&directory.join("views"), "pfm")?,
            depths: numbered(&directory.join("depth"), "pfm")?,
        })
    }

    /// The picture of the whole model, if it was written.
    pub fn overview(&self) -> Option<PathBuf> {
        existing(&self.directory, "model.png")
    }
}

/// One depth map, metres.
pub(crate) fn read_depth(
    files: &BTreeMap<u64, PathBuf>,
    frame: u64,
) -> Result<Option<DepthMap>, ReportingError> {
    Ok(files.get(&frame).map(|path| export::read_pfm(path)).transpose()?)
}

fn read_report(path: &Path) -> Result<Value, ReportingError> {
    if !path.is_file() {
        return Err(ReportingError::NoRun(path.to_path_buf()));
    }
    let text = std::fs::read_to_string(path).map_err(ReportingError::io(path))?;
    serde_json::from_str(&text).map_err(|error| ReportingError::damaged(path, error))
}

fn existing(directory: &Path, name: &str) -> Option<PathBuf> {
    Some(directory.join(name)).filter(|path| path.is_file())
}

fn read_rows<T: DeserializeOwned>(directory: &Path, name: &str) -> Result<Option<Vec<T>>, ReportingError> {
    let Some(path) = existing(directory, name) else { return Ok(None) };
    let damaged = |error: csv::Error| ReportingError::damaged(&path, error);
    let mut reader = csv::Reader::from_path(&path).map_err(damaged)?;
    reader.deserialize().collect::<Result<_, _>>().map(Some).map_err(damaged)
}

/// The files `NNNNNN.extension` of a folder by number; empty without the folder.
fn numbered(folder: &Path, extension: &str) -> Result<BTreeMap<u64, PathBuf>, ReportingError> {
    let mut files = BTreeMap::new();
    if !folder.is_dir() {
        return Ok(files);
    }
    for entry in std::fs::read_dir(folder).map_err(ReportingError::io(folder))? {
        let path = entry.map_err(ReportingError::io(folder))?.path();
        let number = path.file_stem().and_then(|stem| stem.to_str()?.parse().ok());
        if let Some(number) = number.filter(|_| path.extension().is_some_and(|found| found == extension)) {
            files.insert(number, path);
        }
    }
    Ok(files)
}
