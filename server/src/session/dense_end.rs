//! The GPU's side of a session: disparity, fusion, changes; and a new model where the GPU is lost.

use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use dense::disparity::{DisparityConfig, DisparityRange};
use dense::{DenseError, DenseFrame, DenseSlam, StepReport, TrackedCamera};
use geometry::viewpoint::Bounds;
use geometry::{Mask, Pose, Rgb, StereoRig};
use gpu::{Clock, Gpu, GpuError};
use recording::Calibration;
use tracing::trace_span;

use super::correspondences::{LastFused, NumberedFeature};
use super::gpu_turns::Seat;
use super::history::History;
use super::mailbox::{MailboxReceiver, Taken};
use super::map_changes::{MapChange, MapChanges, shares};
use super::quality::FrameQuality;
use super::rectifier::Rectifier;
use super::shared_gpu::SharedGpu;
use super::worker::{FusedPair, Sink, StageConfig, WorkerError, WorkerSetup, milliseconds_since};
use crate::picture::{PictureError, PictureRequest, PictureWanted};

/// Without a pair for this time a session is idle, and what was held back for later is sent.
const IDLE_AFTER: Duration = Duration::from_millis(300);
/// Between attempts to open a device again.
const REOPEN_INTERVAL: Duration = Duration::from_secs(1);

/// A tracked pair on its way to the GPU.
pub(super) struct DenseJob {
    pub index: u32,
    pub pair: RectifiedPair,
    pub quality: FrameQuality,
    pub disparity_drift_px: f64,
    pub features: Vec<NumberedFeature>,
    pub camera: Option<TrackedCamera>,
}

/// A pair as the rectified rig sees it.
pub(super) struct RectifiedPair {
    pub stamp_ns: u64,
    pub sequence: u64,
    pub left: Arc<Rgb>,
    pub right: Rgb,
    pub mask: Option<Mask>,
}

/// The GPU's side of a session.
pub(super) struct DenseEnd {
    shared: Arc<SharedGpu>,
    gpu: Arc<Gpu>,
    model: DenseSlam,
    rig: StereoRig,
    stages: StageConfig,
    calibration: Calibration,
    history: Option<History>,
    changes: MapChanges,
    /// Pairs before this one are of a world that is no more.
    world_since_ns: u64,
    last_fused: LastFused,
    eyes_are_checked: bool,
    /// Where the scope was in the last pair with a pose.
    world_from_scope: Option<Pose>,
    seat: Seat,
}

/// Works until all senders of `jobs` are gone.
pub(super) fn run_dense(
    mut dense: DenseEnd,
    jobs: &MailboxReceiver<DenseJob>,
    pictures: &Receiver<PictureRequest>,
    sink: &dyn Sink,
) {
    let mut last_stamp_ns = 0;
    loop {
        let done = match jobs.take_within(IDLE_AFTER) {
            Taken::Value(job) => {
                last_stamp_ns = job.pair.stamp_ns;
                dense.process(&job, sink)
            }
            Taken::Nothing => dense.idle(last_stamp_ns, sink),
            Taken::Woken => Ok(()),
            Taken::Closed => break,
        };
        let done = match done {
            Err(error) if dense.can_be_rebuilt(&error) => dense.rebuild(&error, (last_stamp_ns, jobs), sink),
            done => done,
        };
        if let Err(error) = done {
            return sink.failed(error.into());
        }
        if let Ok(request) = pictures.try_recv() {
            dense.answer(request);
        }
    }
    let _turn = dense.seat.take();
    if let Err(error) = sink.finished(last_stamp_ns, &mut dense.model) {
        sink.failed(Arc::new(error.into()));
    }
}

impl DenseEnd {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// As [`DenseSlam::new`].
    pub fn new(
        shared: Arc<SharedGpu>,
        rig: StereoRig,
        setup: &WorkerSetup,
        changes: MapChanges,
    ) -> Result<Self, DenseError> {
        let (stages, gpu) = (setup.stages.clone(), shared.current());
        let model = DenseSlam::new(Arc::clone(&gpu), rig, &stages.disparity, &stages.dense)?;
        let (history, seat) = (setup.history.cloned(), setup.gpu_turns.seat());
        let calibration = *setup.calibration;
        let last_fused = LastFused::default();
        Ok(Self {
            shared,
            gpu,
            model,
            rig,
            stages,
            calibration,
            history,
            changes,
            world_since_ns: 0,
            last_fused,
            eyes_are_checked: false,
            world_from_scope: None,
            seat,
        })
    }

    /// Whether an error means that the device is gone or full, and there is something to go on from.
    fn can_be_rebuilt(&self, error: &WorkerError) -> bool {
        let full = matches!(
            error,
            WorkerError::Dense(DenseError::Gpu(GpuError::DeviceLost { .. } | GpuError::OutOfMemory { .. }))
        );
        self.history.is_some() && (full || self.gpu.is_lost())
    }

    /// A new device, and on it a new model of what the journal holds. Poses go on meanwhile; newer pairs are passed
    /// over.
    fn rebuild(
        &mut self,
        why: &WorkerError,
        (last_stamp_ns, jobs): (u64, &MailboxReceiver<DenseJob>),
        sink: &dyn Sink,
    ) -> Result<(), WorkerError> {
        sink.model_lost(&why.to_string());
        loop {
            match self.renewed() {
                Ok(()) => break,
                Err(error) => tracing::error!(%error, "the GPU cannot be used again yet"),
            }
            if let Taken::Closed = jobs.take_within(REOPEN_INTERVAL) {
                return Err(WorkerError::Dense(GpuError::DeviceLost { reason: why.to_string() }.into()));
            }
        }
        Ok(sink.model_rebuilt(last_stamp_ns, &mut self.model)?)
    }

    fn renewed(&mut self) -> Result<(), WorkerError> {
        let Some(history) = self.history.clone() else { return Ok(()) };
        let gpu = self.shared.instead_of(&self.gpu).map_err(DenseError::from)?;
        let model = DenseSlam::new(Arc::clone(&gpu), self.rig, &self.stages.disparity, &self.stages.dense)?;
        (self.gpu, self.model) = (gpu, model);
        self.last_fused = LastFused::default();
        let rectifier = Rectifier::new(&self.calibration)?;
        for (index, (pair, world_from_camera)) in history.pairs(self.world_since_ns)?.enumerate() {
            let pair = rectifier.apply(pair)?;
            let _turn = self.seat.take();
            self.model.step(&DenseFrame {
                index: index as u32,
                stamp_ns: pair.stamp_ns,
                left: &pair.left,
                right: &pair.right,
                mask: pair.mask.as_ref(),
                // The journal does not hold the drift; it is below a pixel.
                disparity_drift_px: 0.0,
                correspondences: &[],
                camera: Some(TrackedCamera { world_from_camera, at_rest: false }),
            })?;
        }
        Ok(())
    }

    fn idle(&mut self, last_stamp_ns: u64, sink: &dyn Sink) -> Result<(), WorkerError> {
        let _turn = self.seat.take();
        Ok(sink.idle(last_stamp_ns, &mut self.model)?)
    }

    /// Draws a picture, or reads the model, in the session's own turn. A GPU that refuses does not end the session for
    /// it.
    fn answer(&self, request: PictureRequest) {
        match request {
            PictureRequest::Picture(wanted, answer) => answer.with(|| self.draw(&wanted)),
            PictureRequest::Surfels(answer) => answer.with(|| {
                let _turn = self.seat.take();
                self.model.surfels().map_err(|error| refused(&error))
            }),
        }
    }

    fn draw(&self, wanted: &PictureWanted) -> Result<Rgb, PictureError> {
        let _turn = self.seat.take();
        let bounds = || {
            let surfels = self.model.surfels().map_err(|error| refused(&error))?;
            Ok(Bounds::of(surfels.iter().map(|surfel| (&surfel.position, &surfel.normal))))
        };
        let scope = self.world_from_scope.as_ref().map(|pose| (&self.rig.left, pose));
        let view = wanted.view(scope, bounds)?;
        Ok(self.model.render(&view, wanted.coloring).map_err(|error| refused(&error))?.rgb)
    }

    /// Brings the model into the world that the pose of `job` is of.
    fn follow_map(&mut self, job: &DenseJob, sink: &dyn Sink) -> Result<(), WorkerError> {
        for change in self.changes.take_until(job.index) {
            let _turn = self.seat.take();
            match change {
                MapChange::Bend { corrections, share } => self.model.bend(&shares(&corrections, share))?,
                MapChange::Restart => {
                    self.model.restart()?;
                    self.last_fused = LastFused::default();
                    self.world_since_ns = job.pair.stamp_ns;
                    sink.model_restarted(job.pair.stamp_ns, &mut self.model)?;
                }
            }
        }
        Ok(())
    }

    fn process(&mut self, job: &DenseJob, sink: &dyn Sink) -> Result<(), WorkerError> {
        let _pair = trace_span!("fuse pair", frame = job.pair.sequence).entered();
        trace_span!("follow map").in_scope(|| self.follow_map(job, sink))?;
        let mut turn = trace_span!("wait for turn").in_scope(|| self.seat.take());
        check_eyes(&mut self.eyes_are_checked, (&self.gpu, &self.rig, &self.stages.disparity), job)?;
        let started = Instant::now();
        let report = self.model.step(&DenseFrame {
            index: job.index,
            stamp_ns: job.pair.stamp_ns,
            left: &job.pair.left,
            right: &job.pair.right,
            mask: job.pair.mask.as_ref(),
            disparity_drift_px: job.disparity_drift_px,
            correspondences: &self.last_fused.join(&job.features),
            camera: job.camera,
        })?;
        if report.fused {
            self.last_fused.replace(&job.features);
        }
        let world_from_camera = report.warp.as_ref().map(|warp| warp.world_from_camera);
        let fused = FusedPair {
            stamp_ns: job.pair.stamp_ns,
            sequence: job.pair.sequence,
            quality: job.quality,
            world_from_camera,
            report,
            dense_ms: milliseconds_since(started),
        };
        self.world_from_scope = fused.world_from_camera.or(self.world_from_scope);
        let step = gpu_time(&fused.report).unwrap_or_else(|| started.elapsed());
        let reading = Instant::now();
        trace_span!("tell model").in_scope(|| sink.fused(&fused, &mut self.model))?;
        turn.measured(step + reading.elapsed());
        Ok(())
    }
}

fn refused(error: &DenseError) -> PictureError {
    PictureError::Gpu(error.to_string())
}

/// Once, on the first picture that shows anything.
fn check_eyes(
    are_checked: &mut bool,
    (gpu, rig, disparity): (&Gpu, &StereoRig, &DisparityConfig),
    job: &DenseJob,
) -> Result<(), WorkerError> {
    if *are_checked || job.quality != FrameQuality::Good {
        return Ok(());
    }
    *are_checked = true;
    let range = DisparityRange::of_rig(rig, disparity)?;
    let eyes = (&*job.pair.left, &job.pair.right);
    let order = dense::disparity::eye_order(gpu, eyes, range, disparity)?;
    if order.is_swapped() { Err(WorkerError::EyesSwapped) } else { Ok(()) }
}

/// What the GPU's own clock says that a step took; `None` where it has none.
fn gpu_time(report: &StepReport) -> Option<Duration> {
    let on_gpu = report.stages.iter().filter(|stage| stage.clock == Clock::Gpu);
    let ms: f64 = on_gpu.map(|stage| stage.ms).sum();
    (ms > 0.0).then(|| Duration::try_from_secs_f64(ms * 1e-3).ok()).flatten()
}
