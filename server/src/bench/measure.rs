//! One run: all pairs of a scene through a session's worker, as fast as they go.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use cpu_time::ProcessTime;
use dense::DenseSlam;
use geometry::Pose;
use gpu::Gpu;
use recording::Calibration;

use super::BenchError;
use super::scene::Scene;
use crate::config::Config;
use crate::convert;
use crate::publish::model_lane::ModelLane;
use crate::session::gpu_turns::GpuTurns;
use crate::session::mailbox::{MailboxReceiver, MailboxSender, Offer, Policy, mailbox};
use crate::session::shared_gpu::SharedGpu;
use crate::session::worker::{
    self, FusedPair, Sink, SinkError, StageConfig, StereoPair, TrackedPair, Worker, WorkerError, WorkerSetup,
};

/// What the counted pairs of one run took.
#[derive(Debug, Default)]
pub(super) struct Measured {
    /// Rectification and tracking of each pair.
    pub tracker_ms: Vec<f64>,
    /// How long each pair had the GPU: the dense step and taking away what changed.
    pub turn_ms: Vec<f64>,
    /// Times of each stage on the tracker's thread.
    pub tracker_stages: BTreeMap<&'static str, Vec<f64>>,
    /// Times of each stage on the GPU.
    pub gpu_stages: BTreeMap<&'static str, Vec<f64>>,
    /// Wall time and time of all cores together.
    pub elapsed: Duration,
    pub cpu: Duration,
    pub fused: u32,
    pub surfels: u32,
    /// Bytes of a session on the GPU at its end.
    pub gpu_bytes: u64,
    /// Why it ended early.
    pub error: Option<Arc<WorkerError>>,
}

/// Measures a session alone on the device, after `warm_up` pairs; `step` is called after each pair.
///
/// The tracker never waits for its mapping, as live, but no pair is passed over.
pub(super) fn run(
    gpu: &Arc<Gpu>,
    config: &Config,
    scene: &Scene,
    warm_up: u32,
    step: &mut dyn FnMut(),
) -> Result<Measured, BenchError> {
    let (done, dones) = mailbox(Policy::Lossless, scene.pairs.len());
    let meter = Arc::new(Meter {
        gpu: Arc::clone(gpu),
        warm_up: u64::from(warm_up),
        weight_max: config.dense.fusion.weight_max,
        done,
        state: Mutex::new(State {
            measured: Measured::default(),
            started: None,
            lane: ModelLane::new(config.publish.lag_limits()),
        }),
    });
    let (sender, receiver) = mailbox(Policy::NewestWins, 1);
    let worker = spawn(gpu, config, scene, (receiver, Arc::clone(&meter)))
        .map_err(|error| BenchError::Worker(Arc::new(error)))?;
    let pairs = scene.pairs.clone();
    let feeding = std::thread::spawn(move || {
        for pair in pairs {
            if sender.offer_by(Policy::Lossless, pair) == Offer::Closed {
                break;
            }
        }
    });
    for _ in &scene.pairs {
        if dones.take() != Some(true) {
            break;
        }
        step();
    }
    // A thread that panicked has said so; the count of fused pairs tells the rest.
    let _ = feeding.join();
    worker.join();
    let meter = Arc::into_inner(meter).expect("the worker has let go of it");
    let measured = meter.state.into_inner().unwrap_or_else(PoisonError::into_inner).measured;
    match measured.error {
        Some(error) => Err(BenchError::Worker(error)),
        None => Ok(measured),
    }
}

fn spawn(
    gpu: &Arc<Gpu>,
    config: &Config,
    scene: &Scene,
    (receiver, meter): (MailboxReceiver<StereoPair>, Arc<Meter>),
) -> Result<Worker, WorkerError> {
    let setup = WorkerSetup {
        stages: &StageConfig::from(config),
        calibration: &Calibration::Rectified(scene.rig),
        policy: Policy::NewestWins,
        history: None,
        gpu_turns: &GpuTurns::new(Duration::from_secs_f64(config.session.gpu_quantum_ms * 1e-3)),
        world_from_start: Pose::identity(),
    };
    let shared = SharedGpu::new(Arc::clone(gpu), config.gpu.clone().with_environment());
    worker::spawn(&setup, Arc::new(shared), receiver, meter)
}

/// The worker's sink: notes times, and publishes the model's changes to no viewer.
struct Meter {
    gpu: Arc<Gpu>,
    warm_up: u64,
    weight_max: f32,
    /// Told `true` for each pair that is through, `false` where the worker fails.
    done: MailboxSender<bool>,
    state: Mutex<State>,
}

struct State {
    measured: Measured,
    /// When the first counted pair came up.
    started: Option<(Instant, ProcessTime)>,
    lane: ModelLane,
}

impl Meter {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sink for Meter {
    fn tracked(&self, pair: &TrackedPair) {
        if pair.sequence < self.warm_up {
            return;
        }
        let measured = &mut self.state().measured;
        measured.tracker_ms.push(pair.rectify_ms + pair.tracking_ms);
        for (name, ms) in [("rectification", pair.rectify_ms), ("tracking", pair.tracking_ms)] {
            measured.tracker_stages.entry(name).or_default().push(ms);
        }
    }

    fn fused(&self, pair: &FusedPair, model: &mut DenseSlam) -> Result<(), SinkError> {
        let taking = Instant::now();
        let changes = model.take_changes(&convert::ENCODING)?;
        let taken_ms = taking.elapsed().as_secs_f64() * 1e3;
        let update = convert::model_update(pair.stamp_ns, &changes, self.weight_max);
        let state = &mut *self.state();
        state.lane.publish(&update)?;
        if pair.sequence >= self.warm_up {
            state.count(pair, taken_ms);
            state.measured.gpu_bytes = self.gpu.memory_use().current_bytes;
        } else if pair.sequence + 1 == self.warm_up {
            state.started = Some((Instant::now(), ProcessTime::now()));
        }
        self.done.offer(true);
        Ok(())
    }

    fn idle(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn finished(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn model_lost(&self, why: &str) {
        tracing::warn!(why, "the GPU was lost during the benchmark");
    }

    fn model_rebuilt(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn model_restarted(&self, _last_stamp_ns: u64, _model: &mut DenseSlam) -> Result<(), SinkError> {
        Ok(())
    }

    fn failed(&self, error: Arc<WorkerError>) {
        self.state().measured.error.get_or_insert(error);
        self.done.offer(false);
    }
}

impl State {
    fn count(&mut self, pair: &FusedPair, taken_ms: f64) {
        let measured = &mut self.measured;
        measured.turn_ms.push(pair.dense_ms + taken_ms);
        for stage in &pair.report.stages {
            measured.gpu_stages.entry(stage.name).or_default().push(stage.ms);
        }
        measured.fused += u32::from(pair.report.fused);
        measured.surfels = pair.report.surfels;
        if let Some((wall, cpu)) = &self.started {
            (measured.elapsed, measured.cpu) = (wall.elapsed(), cpu.elapsed());
        }
    }
}
