//! One session's computation: the tracker on one thread, the dense model on another.
//!
//! The tracker works on frame n+1 while the GPU has frame n (the paper's heterogeneous split). Both hand-overs are
//! [`mailbox`]es of the same policy, so that live video never falls behind and a replay loses nothing.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Instant;

use dense::disparity::DisparityConfig;
use dense::{DenseConfig, DenseError, DenseSlam, StepReport, TrackedCamera};
use geometry::{GeometryError, Gray, Mask, Pose, Rgb, StereoRig};
use recording::Calibration;
use tracing::trace_span;
use tracking::{
    MappingPace, PoseSource, StereoFrame, Tracker, TrackingConfig, TrackingError, TrackingReport,
};

use super::correspondences::numbered;
use super::dense_end::{DenseEnd, DenseJob, RectifiedPair, run_dense};
use super::gpu_turns::GpuTurns;
use super::history::History;
use super::mailbox::{MailboxReceiver, MailboxSender, Offer, Policy, mailbox};
use super::map_changes::{MapChanges, MapFollower};
use super::quality::{FrameQuality, QualityConfig, QualityGate};
use super::rectifier::Rectifier;
use super::shared_gpu::SharedGpu;
use crate::config::Config;
use crate::picture::{PictureInlet, picture_queue};

/// A decoded stereo pair, as it came from the cameras (not yet rectified).
#[derive(Clone, Debug)]
pub struct StereoPair {
    /// Time of exposure, nanoseconds.
    pub stamp_ns: u64,
    /// The source's own number of this pair.
    pub sequence: u64,
    /// Left eye.
    pub left: Rgb,
    /// Right eye.
    pub right: Rgb,
    /// Instruments in the left eye, where the source knows them.
    pub mask: Option<Mask>,
    /// Whether the stages may pass it over for a newer one.
    pub policy: Policy,
}

/// What the tracker found in one pair.
#[derive(Debug)]
pub struct TrackedPair {
    /// Time of exposure, nanoseconds.
    pub stamp_ns: u64,
    /// The source's own number of this pair.
    pub sequence: u64,
    /// Whether the picture is fit for fusion.
    pub quality: FrameQuality,
    /// Pose and features.
    pub report: TrackingReport,
    /// Wall time of rectification, milliseconds.
    pub rectify_ms: f64,
    /// Wall time of the tracker, milliseconds.
    pub tracking_ms: f64,
    /// The rectified left image, for previews.
    pub left: Arc<Rgb>,
    /// An older pair was dropped on the way to the GPU, which is behind.
    pub superseded_dense: bool,
}

/// What the dense model made of one pair.
#[derive(Debug)]
pub struct FusedPair {
    /// Time of exposure, nanoseconds.
    pub stamp_ns: u64,
    /// The source's own number of this pair.
    pub sequence: u64,
    /// Whether the picture was fit for fusion.
    pub quality: FrameQuality,
    /// The pose it was fused at, corrected by the warp's solve; `None` where tracking was lost or the picture unfit, and nothing was fused.
    pub world_from_camera: Option<Pose>,
    /// Counts, residuals and stage times.
    pub report: StepReport,
    /// Wall time of the whole dense step, milliseconds.
    pub dense_ms: f64,
}

/// Where a worker's results go. Called from the worker's threads: `tracked` from the tracker's, `fused` from the
/// GPU's; neither may block for longer than a frame in a live session.
pub trait Sink: Send + Sync + 'static {
    /// A pose is known (or known to be lost).
    fn tracked(&self, pair: &TrackedPair);
    /// The model is up to date with a pair; read back from it what is needed.
    ///
    /// # Errors
    /// A failed read-back ends the worker.
    fn fused(&self, pair: &FusedPair, model: &mut DenseSlam) -> Result<(), SinkError>;
    /// Nothing has come for a while; the model is as `fused` last saw it.
    ///
    /// # Errors
    /// A failed read-back ends the worker.
    fn idle(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError>;
    /// All input has come out; the last look at the model.
    ///
    /// # Errors
    /// A failed read-back is reported to [`Sink::failed`].
    fn finished(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError>;
    /// The model is lost with its GPU and is being rebuilt; poses go on.
    fn model_lost(&self, why: &str);
    /// The model has been rebuilt, on what `model` now is; all of it is to be published anew.
    ///
    /// # Errors
    /// A failed read-back ends the worker.
    fn model_rebuilt(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError>;
    /// The tracker's map was of no use and has been begun anew, and `model` with it: nothing is where it was.
    ///
    /// # Errors
    /// A failed read-back ends the worker.
    fn model_restarted(&self, last_stamp_ns: u64, model: &mut DenseSlam) -> Result<(), SinkError>;
    /// The worker cannot go on.
    fn failed(&self, error: Arc<WorkerError>);
}

/// What a [`Sink`] may fail with.
pub type SinkError = Box<dyn std::error::Error + Send + Sync>;

/// Why a worker stopped or did not start.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The calibration cannot be used.
    #[error("calibration: {0}")]
    Calibration(#[from] GeometryError),
    /// The tracker refused its configuration or input.
    #[error("tracker: {0}")]
    Tracking(#[from] TrackingError),
    /// The GPU stage failed.
    #[error("dense model: {0}")]
    Dense(#[from] DenseError),
    /// The left and right images are exchanged.
    #[error(
        "left and right eye are swapped: points match at negative disparity; exchange the two images or correct the cabling"
    )]
    EyesSwapped,
    /// The journal that a lost model is rebuilt from cannot be read.
    #[error("journal: {0}")]
    Journal(#[from] recording::RecordingError),
    /// Results could not be taken away.
    #[error("results: {0}")]
    Sink(#[from] SinkError),
    /// A thread could not be started.
    #[error("cannot start the {name} thread: {source}")]
    Thread {
        /// Which one.
        name: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// The options of all stages.
#[derive(Clone, Debug)]
pub struct StageConfig {
    /// Tracker.
    pub tracking: TrackingConfig,
    /// Stereo matching.
    pub disparity: DisparityConfig,
    /// Surfel model.
    pub dense: DenseConfig,
    /// Picture quality.
    pub quality: QualityConfig,
}

impl From<&Config> for StageConfig {
    fn from(config: &Config) -> Self {
        Self {
            tracking: config.tracking.clone(),
            disparity: config.disparity.clone(),
            dense: config.dense.clone(),
            quality: config.quality.clone(),
        }
    }
}

/// What a worker is made from.
#[derive(Clone, Copy)]
pub struct WorkerSetup<'a> {
    /// Options.
    pub stages: &'a StageConfig,
    /// The cameras.
    pub calibration: &'a Calibration,
    /// Whether the same pairs must give the same map, or tracking must never wait for the mapping.
    pub policy: Policy,
    /// What a model that is lost with its GPU is rebuilt from; without it such a loss is the end.
    pub history: Option<&'a History>,
    /// Whose turn it is on the GPU that several sessions share.
    pub gpu_turns: &'a Arc<GpuTurns>,
    /// Where the first tracked camera is in the world; the identity unless an earlier session is gone on with.
    pub world_from_start: Pose,
}

/// A running worker; it ends when all senders of its input mailbox are gone.
pub struct Worker {
    threads: Vec<JoinHandle<()>>,
    rig: StereoRig,
    pictures: PictureInlet,
}

impl Worker {
    /// The rectified rig that poses and depth refer to.
    pub fn rig(&self) -> &StereoRig {
        &self.rig
    }

    /// Where pictures of the model are asked for.
    pub fn pictures(&self) -> &PictureInlet {
        &self.pictures
    }

    /// Waits until everything put in has come out.
    pub fn join(self) {
        for thread in self.threads {
            if thread.join().is_err() {
                tracing::error!("a worker thread panicked");
            }
        }
    }
}

/// Starts the two threads of a session. Blocks while GPU pipelines are built: not for the async runtime.
///
/// # Errors
/// [`WorkerError`] where the calibration, a configuration or the GPU refuses.
pub fn spawn(
    setup: &WorkerSetup,
    gpu: Arc<SharedGpu>,
    input: MailboxReceiver<StereoPair>,
    sink: Arc<dyn Sink>,
) -> Result<Worker, WorkerError> {
    let rectifier = Rectifier::new(setup.calibration)?;
    let rig = *rectifier.rig();
    let tracker = Tracker::with_pace(&setup.stages.tracking, &rig, mapping_pace(setup.policy))?;
    let changes = MapChanges::default();
    let map = MapFollower::new(changes.clone(), setup.world_from_start, setup.stages.dense.bend_frames);
    let dense = DenseEnd::new(gpu, rig, setup, changes)?;
    let (jobs_out, jobs_in) = mailbox(setup.policy, 1);
    let waker = jobs_in.waker();
    let (pictures, wanted) = picture_queue(move || waker.wake());
    let quality = QualityGate::new(&setup.stages.quality);
    let front = FrontEnd { rectifier, tracker, quality, map, still_frames: 0 };
    let front_sink = Arc::clone(&sink);
    let tracking = thread("tracker", move || run_front_end(front, &input, &jobs_out, &*front_sink))?;
    let dense = thread("dense", move || run_dense(dense, &jobs_in, &wanted, &*sink))?;
    Ok(Worker { threads: vec![tracking, dense], rig, pictures })
}

/// A replay is to give the same each time, live video must not wait.
fn mapping_pace(policy: Policy) -> MappingPace {
    match policy {
        Policy::Lossless => MappingPace::Lockstep,
        Policy::NewestWins => MappingPace::Asynchronous,
    }
}

fn thread(name: &'static str, body: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, WorkerError> {
    std::thread::Builder::new()
        .name(name.into())
        .spawn(body)
        .map_err(|source| WorkerError::Thread { name, source })
}

/// A camera that has not moved for so many frames is at rest; for fewer, it may be slow.
const REST_FRAMES: u32 = 5;

struct FrontEnd {
    rectifier: Rectifier,
    tracker: Tracker,
    quality: QualityGate,
    map: MapFollower,
    /// Frames in a row in which the tracker saw no motion.
    still_frames: u32,
}

fn run_front_end(
    mut front: FrontEnd,
    input: &MailboxReceiver<StereoPair>,
    jobs: &MailboxSender<DenseJob>,
    sink: &dyn Sink,
) {
    let mut index = 0;
    while let Some(pair) = input.take() {
        let _pair = trace_span!("track pair", frame = pair.sequence).entered();
        match front.process(pair, index, jobs) {
            Ok(tracked) => trace_span!("tell pose").in_scope(|| sink.tracked(&tracked)),
            Err(error) => return sink.failed(error.into()),
        }
        index += 1;
    }
}

impl FrontEnd {
    fn process(
        &mut self,
        pair: StereoPair,
        index: u32,
        jobs: &MailboxSender<DenseJob>,
    ) -> Result<TrackedPair, WorkerError> {
        let started = Instant::now();
        let (pair, left, right) = trace_span!("rectify").in_scope(|| self.rectified(pair))?;
        let rectify_ms = milliseconds_since(started);
        let quality = trace_span!("assess quality").in_scope(|| self.quality.assess(&left, &pair.left));

        let started = Instant::now();
        let frame =
            StereoFrame { stamp_ns: pair.stamp_ns, left: &left, right: &right, mask: pair.mask.as_ref() };
        let mut report = trace_span!("track").in_scope(|| self.tracker.track(&frame))?;
        self.map.follow(&mut report, (pair.stamp_ns, index));
        let tracking_ms = milliseconds_since(started);

        let (stamp_ns, sequence) = (pair.stamp_ns, pair.sequence);
        let is_still = report.source == Some(PoseSource::Standstill);
        self.still_frames = if is_still { self.still_frames + 1 } else { 0 };
        let at_rest = self.still_frames >= REST_FRAMES;
        let camera = report.world_from_camera.filter(|_| quality.allows_fusion());
        let camera = camera.map(|world_from_camera| TrackedCamera { world_from_camera, at_rest });
        let policy = pair.policy;
        let left = Arc::new(pair.left);
        let pair = RectifiedPair {
            stamp_ns,
            sequence,
            left: Arc::clone(&left),
            right: levelled(pair.right, report.drift.row_px),
            mask: pair.mask,
        };
        let disparity_drift_px = report.drift.disparity_px;
        let features = numbered(&report.features);
        let job = DenseJob { index, pair, quality, disparity_drift_px, features, camera };
        let handed_over = trace_span!("hand over").in_scope(|| jobs.offer_by(policy, job));
        let superseded_dense = handed_over == Offer::Superseded;
        Ok(TrackedPair {
            stamp_ns,
            sequence,
            quality,
            report,
            rectify_ms,
            tracking_ms,
            left,
            superseded_dense,
        })
    }
}

impl FrontEnd {
    /// The pair as the rectified rig sees it, and both images in grey.
    fn rectified(&self, pair: StereoPair) -> Result<(StereoPair, Gray, Gray), GeometryError> {
        let pair = self.rectifier.apply(pair)?;
        let (left, right) = (pair.left.to_gray(), pair.right.to_gray());
        Ok((pair, left, right))
    }
}

/// The right image with its rows where the left one's are; a tenth of a pixel changes nothing.
fn levelled(right: Rgb, row_offset_px: f64) -> Rgb {
    if row_offset_px.abs() < 0.1 { right } else { right.rows_shifted(row_offset_px) }
}

pub(super) fn milliseconds_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
