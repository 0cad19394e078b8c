//! Five pictures of each row's model, as in the paper's figure, kept beside the table.

use std::path::{Path, PathBuf};

use crate::error::AccuracyError;

const PICTURES: usize = 5;

/// Copies five views of the model over the run, and the whole model, as `NAME-*.png` into `report`.
pub fn keep(results: &Path, name: &str, report: &Path) -> Result<(), AccuracyError> {
    let views = views(&results.join("views"))?;
    for place in 0..PICTURES.min(views.len()) {
        let view = &views[(place * (views.len() - 1)) / (PICTURES - 1).max(1)];
        let number = view.file_stem().unwrap_or_default().to_string_lossy();
        copy(view, &report.join(format!("{name}-{number}.png")))?;
    }
    copy(&results.join("model.png"), &report.join(format!("{name}-model.png")))
}

fn views(folder: &Path) -> Result<Vec<PathBuf>, AccuracyError> {
    let mut views = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(AccuracyError::io(folder))? {
        let path = entry.map_err(AccuracyError::io(folder))?.path();
        if path.extension().is_some_and(|extension| extension == "png") {
            views.push(path);
        }
    }
    views.sort();
    Ok(views)
}

fn copy(from: &Path, to: &Path) -> Result<(), AccuracyError> {
    std::fs::copy(from, to).map(|_| ()).map_err(AccuracyError::io(from))
}
