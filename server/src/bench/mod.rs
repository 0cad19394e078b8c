//! The standard benchmark: a simulated scene, made in memory, through the real pipeline, once for each size and profile.

use std::sync::Arc;

use gpu::{Gpu, GpuError};
use simulator::{SceneConfig, SceneKind, SimulatorError};

use crate::config::{Config, Profile};
use crate::session::worker::WorkerError;

mod measure;
mod report;
mod scene;

pub use report::{BenchCase, BenchReport, Limit, Sessions, StageShare};
use scene::Scene;

/// What is measured.
#[derive(Clone, Debug)]
pub struct BenchOptions {
    /// Columns and rows of the images.
    pub sizes_px: Vec<(u32, u32)>,
    /// Options of all stages, by the name of their profile.
    pub profiles: Vec<(Profile, Config)>,
    /// Pairs of each run, of which the first are not counted: caches are cold then, and the model is empty.
    pub pairs: u32,
    /// How many are not counted.
    pub warm_up: u32,
}

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A number of pairs that leaves nothing to count.
    #[error("{pairs} pairs, of which {warm_up} are not counted, are too few")]
    TooFewPairs {
        /// In all.
        pairs: u32,
        /// Not counted.
        warm_up: u32,
    },
    /// The scene cannot be made at such a size.
    #[error(transparent)]
    Scene(#[from] SimulatorError),
    /// No GPU.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The reconstruction failed.
    #[error(transparent)]
    Worker(Arc<WorkerError>),
    /// The times would be those of something else.
    #[error("{profile} at {}x{}: only {fused} of {pairs} pairs were fused", .size_px.0, .size_px.1)]
    NotFused {
        /// The profile.
        profile: Profile,
        /// The size.
        size_px: (u32, u32),
        /// Pairs fused.
        fused: u32,
        /// Pairs counted.
        pairs: u32,
    },
}

/// Runs it. `progress` is told steps done and in all.
///
/// # Errors
/// [`BenchError`].
pub fn bench(options: &BenchOptions, progress: &mut dyn FnMut(u64, u64)) -> Result<BenchReport, BenchError> {
    let (pairs, warm_up) = (options.pairs, options.warm_up);
    if pairs <= warm_up + 1 {
        return Err(BenchError::TooFewPairs { pairs, warm_up });
    }
    let runs = options.sizes_px.len() * (1 + options.profiles.len());
    let total = runs as u64 * u64::from(pairs);
    let mut done = 0;
    let mut step = || {
        done += 1;
        progress(done, total);
    };
    let mut cases = Vec::new();
    let mut adapter = None;
    for &size_px in &options.sizes_px {
        let mut scene: Option<Scene> = None;
        for (profile, config) in &options.profiles {
            let scene = match &scene {
                Some(scene) => scene,
                None => scene.insert(Scene::render(&scene_config(config, size_px, pairs), &mut step)?),
            };
            // A device of its own, so that its memory is this run's alone.
            let gpu = Arc::new(Gpu::open(&config.gpu.clone().with_environment())?);
            let measured = measure::run(&gpu, config, scene, warm_up, &mut step)?;
            cases.push(report::case(*profile, size_px, &measured)?);
            adapter.get_or_insert_with(|| gpu.description().clone());
        }
    }
    Ok(BenchReport::new(adapter, pairs - warm_up, cases))
}

/// The liver: it breathes and is pushed, as the tissue does that this is for.
fn scene_config(config: &Config, (width_px, height_px): (u32, u32), frames: u32) -> SceneConfig {
    SceneConfig { scene: SceneKind::Liver, frames, width_px, height_px, ..config.simulate.clone() }
}
