//! The real computation: tracker and dense model, their results put on the session's lanes.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use dense::{DenseSlam, Surfel};
use geometry::Rgb;
use geometry::viewpoint::Bounds;
use gpu::Gpu;
use protocol::SessionId;
use protocol::v1::Reason;
use recording::PairingStatistics;
use recording::export::PlySurfel;

use super::engine::{Engine, EngineError, EngineResults, EngineStart, RunningEngine};
use super::gpu_turns::GpuTurns;
use super::hub::{Hub, PoseUpdate};
use super::mailbox::MailboxReceiver;
use super::shared_gpu::SharedGpu;
use super::worker::{
    self, FusedPair, Sink, SinkError, StageConfig, StereoPair, TrackedPair, Worker, WorkerError, WorkerSetup,
};
use crate::config::Config;
use crate::picture::{PictureError, PictureInlet, PictureWanted};
use crate::publish::{PublishConfig, Throttle};
use crate::replay::collector::Collector;
use crate::replay::files::{self, Run};
use crate::{convert, feature_picture};

/// Tracker and dense model on one GPU that all sessions share.
pub struct GpuEngine {
    gpu: Arc<SharedGpu>,
    stages: StageConfig,
    publish: PublishConfig,
    turns: Arc<GpuTurns>,
    observer: Option<Box<ObserverOf>>,
}

/// What else a session's results go to.
type ObserverOf = dyn Fn(&SessionId) -> Arc<dyn Sink> + Send + Sync;

impl GpuEngine {
    /// The configured reconstruction on an open device.
    pub fn new(gpu: Arc<Gpu>, config: &Config) -> Self {
        let gpu = SharedGpu::new(gpu, config.gpu.clone().with_environment());
        Self {
            gpu: Arc::new(gpu),
            stages: StageConfig::from(config),
            publish: config.publish.clone(),
            turns: GpuTurns::new(Duration::from_secs_f64(config.session.gpu_quantum_ms * 1e-3)),
            observer: None,
        }
    }

    /// Results of each session also go to what `observer` gives for it, after they were published.
    #[must_use]
    pub fn observed_by(self, observer: impl Fn(&SessionId) -> Arc<dyn Sink> + Send + Sync + 'static) -> Self {
        Self { observer: Some(Box::new(observer)), ..self }
    }

    /// Whose turn it is on the GPU.
    pub fn turns(&self) -> &Arc<GpuTurns> {
        &self.turns
    }
}

impl Engine for GpuEngine {
    fn start(
        &self,
        start: &EngineStart,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError> {
        let setup = WorkerSetup {
            stages: &self.stages,
            calibration: start.calibration,
            gpu_turns: &self.turns,
            world_from_start: start.world_from_start,
            policy: start.policy,
            history: start.history,
        };
        let collector = Arc::new(Collector::of_session());
        let sink = LiveSink {
            hub: Arc::clone(&hub),
            preview_jpeg_quality: self.publish.preview_jpeg_quality,
            preview_features: self.publish.preview_features,
            preview: Mutex::new(Throttle::new(self.publish.preview_hz)),
            model: Mutex::new(Throttle::new(self.publish.model_hz)),
            weight_max: self.stages.dense.fusion.weight_max,
            observers: self
                .observer
                .iter()
                .map(|of| of(hub.id()))
                .chain([Arc::clone(&collector) as _])
                .collect(),
        };
        let worker = worker::spawn(&setup, Arc::clone(&self.gpu), pairs, Arc::new(sink))
            .map_err(|error| EngineError(error.to_string()))?;
        hub.set_camera(convert::camera_to_wire(&worker.rig().left));
        Ok(Box::new(Running { worker, collector, hub, gpu: Arc::clone(&self.gpu), started: Instant::now() }))
    }

    fn draw(&self, model: &[PlySurfel], wanted: &PictureWanted) -> Result<Rgb, PictureError> {
        let bounds = || Ok(Bounds::of(model.iter().map(|surfel| (&surfel.position, &surfel.normal))));
        let view = wanted.view(None, bounds)?;
        let surfels: Vec<Surfel> = model.iter().zip(0..).map(convert::surfel_from_ply).collect();
        let seat = self.turns.seat();
        let _turn = seat.take();
        let paint = (wanted.coloring, self.stages.dense.fusion.weight_max);
        let drawn = dense::render_surfels(&self.gpu.current(), &surfels, &view, paint);
        drawn.map(|rendering| rendering.rgb).map_err(|error| PictureError::Gpu(error.to_string()))
    }
}

struct Running {
    worker: Worker,
    collector: Arc<Collector>,
    hub: Arc<Hub>,
    gpu: Arc<SharedGpu>,
    started: Instant,
}

impl RunningEngine for Running {
    fn pictures(&self) -> Option<PictureInlet> {
        Some(self.worker.pictures().clone())
    }

    fn join(self: Box<Self>) -> Option<EngineResults> {
        self.worker.join();
        let collected = Arc::into_inner(self.collector)?.into_collected();
        let state = self.hub.snapshot_state();
        let statistics = PairingStatistics { pairs: state.pairs_received, ..PairingStatistics::default() };
        let run = Run {
            recording: None,
            gpu: &self.gpu.current(),
            statistics: &statistics,
            truncated: false,
            wall: self.started.elapsed(),
        };
        let mut results = files::results(&collected, &run);
        // The session counts every pair that was left out, wherever that was.
        results.report.reasons = state.drops.iter().map(|drop| (drop.reason().name(), drop.count)).collect();
        Some(results)
    }
}

/// Puts a worker's results on the lanes.
struct LiveSink {
    hub: Arc<Hub>,
    preview_jpeg_quality: u8,
    preview_features: bool,
    preview: Mutex<Throttle>,
    model: Mutex<Throttle>,
    weight_max: f32,
    observers: Vec<Arc<dyn Sink>>,
}

fn admits(throttle: &Mutex<Throttle>) -> bool {
    throttle.lock().unwrap_or_else(PoisonError::into_inner).admits(Instant::now())
}

impl LiveSink {
    fn publish_preview(&self, pair: &TrackedPair) {
        let drawn = self.preview_features.then(|| feature_picture::draw(&pair.left, &pair.report.features));
        match recording::encode_jpeg(drawn.as_ref().unwrap_or(&*pair.left), self.preview_jpeg_quality) {
            Ok(image) => {
                if self.hub.features.receiver_count() > 0 {
                    let features = convert::features_to_wire(pair.stamp_ns, &pair.report.features);
                    self.hub.publish_features(features);
                }
                self.hub.publish_preview(pair.stamp_ns, convert::jpeg_to_wire(image, pair.left.size()));
            }
            Err(error) => tracing::warn!(session = %self.hub.id(), %error, "no preview"),
        }
    }

    fn publish_changes(&self, stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        let changes = model.take_changes(&convert::ENCODING)?;
        self.hub.publish_model(&convert::model_update(stamp_ns, &changes, self.weight_max))?;
        self.bring_shapes(model)
    }

    /// Viewers that join need what all others hold, right after it was published.
    fn bring_shapes(&self, model: &DenseSlam) -> Result<(), SinkError> {
        if self.hub.model.wants_shapes() {
            let held = model.held_surfels()?;
            let shapes = held.iter().map(|surfel| convert::surfel_to_wire(surfel, self.weight_max));
            self.hub.model.bring_shapes(shapes.collect());
        }
        Ok(())
    }
}

impl Sink for LiveSink {
    fn tracked(&self, pair: &TrackedPair) {
        self.hub.publish_pose(&PoseUpdate {
            stamp_ns: pair.stamp_ns,
            sequence: pair.sequence,
            outcome: convert::outcome_to_wire(pair.report.outcome),
            world_from_camera: pair.report.world_from_camera.as_ref().map(convert::pose_to_wire),
            matched_features: pair.report.statistics.inliers as u32,
            lost_for_ns: convert::lost_for_ns(pair.report.outcome, pair.stamp_ns),
            picture: pair.quality.name(),
        });
        if pair.superseded_dense {
            let rebuilding = self.hub.model_is_stale();
            let reason = if rebuilding { Reason::ModelRebuilding } else { Reason::FusionSuperseded };
            self.hub.count_drop(reason);
        }
        if admits(&self.preview) {
            self.publish_preview(pair);
        }
        self.observers.iter().for_each(|observer| observer.tracked(pair));
    }

    fn fused(&self, pair: &FusedPair, model: &mut DenseSlam) -> Result<(), SinkError> {
        match convert::not_fused(pair) {
            None => self.hub.count_fused(),
            Some(reason) => self.hub.count_drop(reason),
        }
        if admits(&self.model) {
            self.publish_changes(pair.stamp_ns, model)?;
        }
        self.observers.iter().try_for_each(|observer| observer.fused(pair, model))
    }

    fn idle(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        let changes = model.take_changes(&convert::ENCODING)?;
        let held_back = convert::model_update(last_stamp_ns, &changes, self.weight_max);
        if !held_back.is_empty() {
            self.hub.publish_model(&held_back)?;
        }
        self.bring_shapes(model)
    }

    fn finished(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        self.publish_changes(last_stamp_ns, model)?;
        self.observers.iter().try_for_each(|observer| observer.finished(last_stamp_ns, model))
    }

    fn model_lost(&self, why: &str) {
        tracing::error!(session = %self.hub.id(), why, "the model is lost and is being rebuilt");
        self.hub.raise_alarm(&format!("the model was lost and rebuilt from the journal: {why}"));
        self.hub.set_model_stale(true);
        self.observers.iter().for_each(|observer| observer.model_lost(why));
    }

    fn model_rebuilt(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        // The surfels of the new model have ids of their own.
        self.hub.model.clear()?;
        self.publish_changes(last_stamp_ns, model)?;
        self.hub.set_model_stale(false);
        self.observers.iter().try_for_each(|observer| observer.model_rebuilt(last_stamp_ns, model))
    }

    fn model_restarted(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        let why = "the camera was lost before there was a map to find it in; the model begins anew";
        tracing::warn!(session = %self.hub.id(), why);
        self.hub.raise_alarm(why);
        self.hub.model.clear()?;
        self.publish_changes(last_stamp_ns, model)?;
        self.observers.iter().try_for_each(|observer| observer.model_restarted(last_stamp_ns, model))
    }

    fn failed(&self, error: Arc<WorkerError>) {
        tracing::error!(session = %self.hub.id(), %error, "the reconstruction failed");
        self.hub.fail(error.to_string());
        self.observers.iter().for_each(|observer| observer.failed(Arc::clone(&error)));
    }
}
