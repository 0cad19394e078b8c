//! The GPU's part: what of each frame has to be told.

use std::sync::Arc;
use std::time::Instant;

use dense::synthetic::SyntheticModel;
use dense::{DenseConfig, Surfel};
use gpu::{AdapterSelection, Gpu};
use mis_slam::config::Config;
use mis_slam::convert;
use mis_slam::publish::model_lane::ModelUpdate;

use crate::arguments::Arguments;
use crate::clock::thread_cpu;
use crate::error::StreamError;
use crate::sheet::Sheet;

/// So many frames apart, the truth and what viewers hold are kept.
pub const KEPT_EVERY: usize = 5;

/// A whole run of the sheet.
pub struct Run {
    pub adapter: String,
    pub surfels: u32,
    pub nodes: usize,
    pub bound_mm: f64,
    pub frames: Vec<Frame>,
}

/// One frame of it.
pub struct Frame {
    pub update: ModelUpdate,
    /// What the model is, and what viewers hold of it, by id; in every fifth frame.
    pub kept: Option<Arc<Kept>>,
    /// Wall time of the selection, and the passes' own.
    pub selection_ms: f64,
    pub passes_ms: f64,
    /// CPU time of the thread that drives it, the software GPU's threads not counted.
    pub driving_cpu_ms: f64,
}

pub struct Kept {
    pub truth: Vec<Surfel>,
    pub held: Vec<Surfel>,
}

/// Runs the sheet.
pub fn select(arguments: &Arguments, surfels: u32, frames: usize) -> Result<Run, StreamError> {
    let config = Config::load(None, &[])?.dense;
    let gpu = Arc::new(Gpu::open(&AdapterSelection { adapter: String::new() }.with_environment())?);
    let adapter = gpu.description().name.clone();
    let sheet = Sheet::new(surfels);
    let mut model = SyntheticModel::new(gpu, &config, surfels)?;
    let mut before_s = 0.0;
    let mut selected = Vec::with_capacity(frames);
    for frame in 0..frames {
        let now_s = frame as f64 / arguments.rate_hz;
        let truth = sheet.surfels_at(now_s, frame as u32);
        model.set(&truth, &sheet.nodes_at(before_s, now_s))?;
        selected.push(select_frame(&mut model, &config, frame, truth)?);
        before_s = now_s;
    }
    let bound_mm = config.publish.position_mm;
    Ok(Run { adapter, surfels, nodes: sheet.nodes(), bound_mm, frames: selected })
}

fn select_frame(
    model: &mut SyntheticModel,
    config: &DenseConfig,
    frame: usize,
    truth: Vec<Surfel>,
) -> Result<Frame, StreamError> {
    let (begin, cpu) = (Instant::now(), thread_cpu());
    let changes = model.take_changes(&convert::ENCODING)?;
    let selection_ms = begin.elapsed().as_secs_f64() * 1e3;
    let update = convert::model_update((frame + 1) as u64, &changes, config.fusion.weight_max);
    let driving_cpu_ms = (thread_cpu() - cpu).as_secs_f64() * 1e3;
    let kept = if frame.is_multiple_of(KEPT_EVERY) {
        Some(Arc::new(Kept { truth, held: model.held_surfels()? }))
    } else {
        None
    };
    let passes_ms = changes.stages.iter().map(|stage| stage.ms).sum();
    Ok(Frame { update, kept, selection_ms, passes_ms, driving_cpu_ms })
}
