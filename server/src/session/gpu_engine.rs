//! The real computation: tracker and dense model, their results put on the session's lanes.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use dense::DenseSlam;
use gpu::Gpu;
use protocol::v1::Reason;
use recording::Calibration;

use super::engine::{Engine, EngineError, RunningEngine};
use super::hub::{Hub, PoseUpdate};
use super::mailbox::{MailboxReceiver, Policy};
use super::worker::{
    self, FusedPair, Sink, SinkError, StageConfig, StereoPair, TrackedPair, Worker, WorkerError, WorkerSetup,
};
use crate::config::Config;
use crate::convert;
use crate::publish::{PublishConfig, Throttle};

/// Tracker and dense model on one GPU that all sessions share.
pub struct GpuEngine {
    gpu: Arc<Gpu>,
    stages: StageConfig,
    publish: PublishConfig,
    observer: Option<Arc<dyn Sink>>,
}

impl GpuEngine {
    /// The configured reconstruction on an open device.
    pub fn new(gpu: Arc<Gpu>, config: &Config) -> Self {
        Self { gpu, stages: StageConfig::from(config), publish: config.publish.clone(), observer: None }
    }

    /// Results also go to `observer`, after they were published.
    #[must_use]
    pub fn observed_by(self, observer: Arc<dyn Sink>) -> Self {
        Self { observer: Some(observer), ..self }
    }
}

impl Engine for GpuEngine {
    fn start(
        &self,
        calibration: &Calibration,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError> {
        let setup = WorkerSetup { stages: &self.stages, calibration, policy: Policy::NewestWins };
        let sink = LiveSink {
            hub: Arc::clone(&hub),
            preview_jpeg_quality: self.publish.preview_jpeg_quality,
            preview: Mutex::new(Throttle::new(self.publish.preview_hz)),
            model: Mutex::new(Throttle::new(self.publish.model_hz)),
            weight_max: self.stages.dense.fusion.weight_max,
            observer: self.observer.clone(),
        };
        let worker = worker::spawn(&setup, Arc::clone(&self.gpu), pairs, Arc::new(sink))
            .map_err(|error| EngineError(error.to_string()))?;
        hub.set_camera(convert::camera_to_wire(&worker.rig().left));
        Ok(Box::new(worker))
    }
}

impl RunningEngine for Worker {
    fn join(self: Box<Self>) {
        Self::join(*self);
    }
}

/// Puts a worker's results on the lanes.
struct LiveSink {
    hub: Arc<Hub>,
    preview_jpeg_quality: u8,
    preview: Mutex<Throttle>,
    model: Mutex<Throttle>,
    weight_max: f32,
    observer: Option<Arc<dyn Sink>>,
}

fn admits(throttle: &Mutex<Throttle>) -> bool {
    throttle.lock().unwrap_or_else(PoisonError::into_inner).admits(Instant::now())
}

impl LiveSink {
    fn publish_preview(&self, pair: &TrackedPair) {
        match recording::encode_jpeg(&pair.left, self.preview_jpeg_quality) {
            Ok(image) => {
                self.hub.publish_preview(pair.stamp_ns, convert::jpeg_to_wire(image, pair.left.size()));
            }
            Err(error) => tracing::warn!(session = %self.hub.id(), %error, "no preview"),
        }
    }

    fn publish_changes(&self, stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        let update = convert::model_update(stamp_ns, &model.take_changes()?, self.weight_max);
        Ok(self.hub.publish_model(&update)?)
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
            self.hub.count_drop(Reason::FusionSuperseded);
        }
        if admits(&self.preview) {
            self.publish_preview(pair);
        }
        if let Some(observer) = &self.observer {
            observer.tracked(pair);
        }
    }

    fn fused(&self, pair: &FusedPair, model: &mut DenseSlam) -> Result<(), SinkError> {
        if pair.report.fused {
            self.hub.count_fused();
        }
        if admits(&self.model) {
            self.publish_changes(pair.stamp_ns, model)?;
        }
        self.observer.as_ref().map_or(Ok(()), |observer| observer.fused(pair, model))
    }

    fn idle(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        let held_back = convert::model_update(last_stamp_ns, &model.take_changes()?, self.weight_max);
        if !held_back.is_empty() {
            self.hub.publish_model(&held_back)?;
        }
        Ok(())
    }

    fn finished(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError> {
        self.publish_changes(last_stamp_ns, model)?;
        self.observer.as_ref().map_or(Ok(()), |observer| observer.finished(last_stamp_ns, model))
    }

    fn failed(&self, error: WorkerError) {
        tracing::error!(session = %self.hub.id(), %error, "the reconstruction failed");
        self.hub.fail(error.to_string());
        if let Some(observer) = &self.observer {
            observer.failed(error);
        }
    }
}
