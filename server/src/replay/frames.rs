//! `frames.csv`: how well the model fitted each frame with a pose before that frame was fused.

use std::path::Path;

use dense::BackProjection;
use serde::{Deserialize, Serialize};

use super::ReplayError;
use crate::session::worker::FusedPair;

const MM_PER_M: f64 = 1e3;

/// One frame; errors are empty where nothing of the model was in view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameRow {
    /// Pair number in the recording.
    pub frame: u64,
    /// Time stamp, nanoseconds.
    pub stamp_ns: u64,
    /// Whether it was fused.
    pub fused: bool,
    /// Mean back-projection error, millimetres.
    pub mean_mm: Option<f64>,
    /// Median.
    pub median_mm: Option<f64>,
    /// Root of the mean square.
    pub rmse_mm: Option<f64>,
    /// 95th percentile.
    pub p95_mm: Option<f64>,
    /// Share of the measured pixels that show the model.
    pub coverage: Option<f64>,
    /// Mean over every 7th block of pixels, which the solver can be told to leave out.
    pub held_out_mean_mm: Option<f64>,
    /// Root of the mean square there.
    pub held_out_rmse_mm: Option<f64>,
    /// Mean over all other pixels.
    pub others_mean_mm: Option<f64>,
    /// Deformation nodes after the frame.
    pub nodes: Option<u32>,
    /// Those that were solved: what was seen of the tissue, and the neighbours.
    pub nodes_solved: Option<u32>,
    /// Steps that the solver took.
    pub solver_steps: Option<u32>,
    /// Share of the energy at the tracker's pose and in the shape before that the solution kept.
    pub energy_left: Option<f64>,
}

impl FrameRow {
    pub(super) fn new(pair: &FusedPair) -> Self {
        let error = pair.report.back_projection.as_ref();
        let mm = |value: fn(&BackProjection) -> f64| error.map(|error| value(error) * MM_PER_M);
        let held_out = error.and_then(|error| error.held_out);
        let warp = pair.report.warp.as_ref();
        Self {
            frame: pair.sequence,
            stamp_ns: pair.stamp_ns,
            fused: pair.report.fused,
            mean_mm: mm(|error| error.mean_m),
            median_mm: mm(|error| error.median_m),
            rmse_mm: mm(|error| error.rmse_m),
            p95_mm: mm(|error| error.p95_m),
            coverage: error.map(|error| error.coverage),
            held_out_mean_mm: held_out.map(|error| error.mean_m * MM_PER_M),
            held_out_rmse_mm: held_out.map(|error| error.rmse_m * MM_PER_M),
            others_mean_mm: held_out.map(|error| error.others_mean_m * MM_PER_M),
            nodes: warp.map(|warp| warp.nodes),
            nodes_solved: warp.map(|warp| warp.solved),
            solver_steps: warp.map(|warp| warp.steps),
            energy_left: warp.map(|warp| warp.energy_left),
        }
    }

    /// Reads what a replay wrote.
    ///
    /// # Errors
    /// [`ReplayError::Frames`] names the file and the line.
    pub fn read(path: &Path) -> Result<Vec<Self>, ReplayError> {
        let mut reader = csv::Reader::from_path(path).map_err(refused(path))?;
        reader.deserialize().map(|row| row.map_err(refused(path))).collect()
    }
}

/// Writes a row for each frame.
pub(super) fn write_rows(path: &Path, rows: &[impl Serialize]) -> Result<(), ReplayError> {
    let mut writer = csv::Writer::from_path(path).map_err(refused(path))?;
    for row in rows {
        writer.serialize(row).map_err(refused(path))?;
    }
    writer.flush().map_err(ReplayError::io(path))
}

fn refused(path: &Path) -> impl Fn(csv::Error) -> ReplayError + '_ {
    |source| ReplayError::Frames { path: path.to_path_buf(), source }
}
