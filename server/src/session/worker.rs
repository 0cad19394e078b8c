//! One session's computation: the tracker on one thread, the dense model on another.
//!
//! The tracker works on frame n+1 while the GPU has frame n (the paper's heterogeneous split). Both hand-overs are
//! [`mailbox`]es of the same policy, so that live video never falls behind and a replay loses nothing.

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use dense::disparity::{DisparityConfig, DisparityRange};
use dense::{DenseConfig, DenseError, DenseFrame, DenseSlam, StepReport};
use geometry::{Eye, GeometryError, Mask, Pose, Rectification, Rgb, StereoRig};
use gpu::Gpu;
use recording::Calibration;
use tracking::{MappingPace, StereoFrame, Tracker, TrackingConfig, TrackingError, TrackingReport};

use super::correspondences::{LastFused, NumberedFeature, numbered};
use super::mailbox::{MailboxReceiver, MailboxSender, Offer, Policy, Taken, mailbox};
use super::quality::{FrameQuality, QualityConfig, QualityGate};
use crate::config::Config;

/// Without a pair for this time a session is idle, and what was held back for later is sent.
const IDLE_AFTER: Duration = Duration::from_millis(300);

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
    /// The pose it was fused at; `None` where tracking was lost or the picture unfit, and nothing was fused.
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
    /// The worker cannot go on.
    fn failed(&self, error: WorkerError);
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
#[derive(Clone, Copy, Debug)]
pub struct WorkerSetup<'a> {
    /// Options.
    pub stages: &'a StageConfig,
    /// The cameras.
    pub calibration: &'a Calibration,
    /// Live or replay.
    pub policy: Policy,
}

/// A running worker; it ends when all senders of its input mailbox are gone.
pub struct Worker {
    threads: Vec<JoinHandle<()>>,
    rig: StereoRig,
}

impl Worker {
    /// The rectified rig that poses and depth refer to.
    pub fn rig(&self) -> &StereoRig {
        &self.rig
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
    gpu: Arc<Gpu>,
    input: MailboxReceiver<StereoPair>,
    sink: Arc<dyn Sink>,
) -> Result<Worker, WorkerError> {
    let rectifier = Rectifier::new(setup.calibration)?;
    let rig = *rectifier.rig();
    let tracker = Tracker::with_pace(&setup.stages.tracking, &rig, mapping_pace(setup.policy))?;
    let dense = DenseEnd::new(gpu, rig, setup.stages)?;
    let (jobs_out, jobs_in) = mailbox(setup.policy, 1);
    let front = FrontEnd { rectifier, tracker, quality: QualityGate::new(&setup.stages.quality) };
    let front_sink = Arc::clone(&sink);
    let tracking = thread("tracker", move || run_front_end(front, &input, &jobs_out, &*front_sink))?;
    let dense = thread("dense", move || run_dense(dense, &jobs_in, &*sink))?;
    Ok(Worker { threads: vec![tracking, dense], rig })
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

/// Brings pairs into the rectified rig.
enum Rectifier {
    AlreadyRectified(StereoRig),
    Remap(Box<Remap>),
}

struct Remap {
    rectification: Rectification,
    /// Rectified pixels that the left camera does not see; `None` where it sees all.
    blind: Option<Mask>,
}

impl Remap {
    fn new(rectification: Rectification) -> Self {
        let blind = rectification.blind_mask(Eye::Left);
        let blind = blind.pixels().iter().any(|&covered| covered != 0).then_some(blind);
        Self { rectification, blind }
    }

    fn apply(&self, pair: &StereoPair) -> Result<StereoPair, GeometryError> {
        let (left, right) = self.rectification.rectify_rgb(&pair.left, &pair.right)?;
        let instruments = pair.mask.as_ref();
        let instruments =
            instruments.map(|mask| self.rectification.rectify_mask(Eye::Left, mask)).transpose()?;
        let mask = instruments.or_else(|| self.blind.clone());
        Ok(StereoPair { left, right, mask, stamp_ns: pair.stamp_ns, sequence: pair.sequence })
    }
}

impl Rectifier {
    fn new(calibration: &Calibration) -> Result<Self, GeometryError> {
        Ok(match calibration {
            Calibration::Rectified(rig) => Self::AlreadyRectified(*rig),
            Calibration::Raw(raw) => Self::Remap(Box::new(Remap::new(Rectification::from_calibration(raw)?))),
        })
    }

    fn rig(&self) -> &StereoRig {
        match self {
            Self::AlreadyRectified(rig) => rig,
            Self::Remap(remap) => remap.rectification.rig(),
        }
    }

    fn apply(&self, pair: StereoPair) -> Result<StereoPair, GeometryError> {
        match self {
            Self::AlreadyRectified(_) => Ok(pair),
            Self::Remap(remap) => remap.apply(&pair),
        }
    }
}

struct DenseJob {
    index: u32,
    pair: RectifiedPair,
    quality: FrameQuality,
    disparity_drift_px: f64,
    features: Vec<NumberedFeature>,
    world_from_camera: Option<Pose>,
}

struct RectifiedPair {
    stamp_ns: u64,
    sequence: u64,
    left: Arc<Rgb>,
    right: Rgb,
    mask: Option<Mask>,
}

struct FrontEnd {
    rectifier: Rectifier,
    tracker: Tracker,
    quality: QualityGate,
}

fn run_front_end(
    mut front: FrontEnd,
    input: &MailboxReceiver<StereoPair>,
    jobs: &MailboxSender<DenseJob>,
    sink: &dyn Sink,
) {
    let mut index = 0;
    while let Some(pair) = input.take() {
        match front.process(pair, index, jobs) {
            Ok(tracked) => sink.tracked(&tracked),
            Err(error) => return sink.failed(error),
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
        let pair = self.rectifier.apply(pair)?;
        let (left, right) = (pair.left.to_gray(), pair.right.to_gray());
        let rectify_ms = milliseconds_since(started);
        let quality = self.quality.assess(&left);

        let started = Instant::now();
        let frame =
            StereoFrame { stamp_ns: pair.stamp_ns, left: &left, right: &right, mask: pair.mask.as_ref() };
        let report = self.tracker.track(&frame)?;
        let tracking_ms = milliseconds_since(started);

        let (stamp_ns, sequence) = (pair.stamp_ns, pair.sequence);
        let world_from_camera = report.world_from_camera.filter(|_| quality.allows_fusion());
        let left = Arc::new(pair.left);
        let pair = RectifiedPair {
            stamp_ns,
            sequence,
            left: Arc::clone(&left),
            right: levelled(pair.right, report.drift.row_px),
            mask: pair.mask,
        };
        let superseded_dense = jobs.offer(DenseJob {
            index,
            pair,
            quality,
            disparity_drift_px: report.drift.disparity_px,
            features: numbered(&report.features),
            world_from_camera,
        }) == Offer::Superseded;
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

/// The GPU's side of a session.
struct DenseEnd {
    gpu: Arc<Gpu>,
    model: DenseSlam,
    disparity: DisparityConfig,
    last_fused: LastFused,
    eyes_are_checked: bool,
}

fn run_dense(mut dense: DenseEnd, jobs: &MailboxReceiver<DenseJob>, sink: &dyn Sink) {
    let mut last_stamp_ns = 0;
    loop {
        let done = match jobs.take_within(IDLE_AFTER) {
            Taken::Value(job) => {
                last_stamp_ns = job.pair.stamp_ns;
                dense.process(&job, sink)
            }
            Taken::Nothing => sink.idle(last_stamp_ns, &mut dense.model).map_err(WorkerError::from),
            Taken::Closed => break,
        };
        if let Err(error) = done {
            return sink.failed(error);
        }
    }
    if let Err(error) = sink.finished(last_stamp_ns, &mut dense.model) {
        sink.failed(error.into());
    }
}

impl DenseEnd {
    fn new(gpu: Arc<Gpu>, rig: StereoRig, stages: &StageConfig) -> Result<Self, DenseError> {
        let model = DenseSlam::new(Arc::clone(&gpu), rig, &stages.disparity, &stages.dense)?;
        let (disparity, last_fused) = (stages.disparity.clone(), LastFused::default());
        Ok(Self { gpu, model, disparity, last_fused, eyes_are_checked: false })
    }

    fn process(&mut self, job: &DenseJob, sink: &dyn Sink) -> Result<(), WorkerError> {
        self.refuse_swapped_eyes(job)?;
        let started = Instant::now();
        let report = self.model.step(&DenseFrame {
            index: job.index,
            stamp_ns: job.pair.stamp_ns,
            left: &job.pair.left,
            right: &job.pair.right,
            mask: job.pair.mask.as_ref(),
            disparity_drift_px: job.disparity_drift_px,
            correspondences: &self.last_fused.join(&job.features),
            world_from_camera: job.world_from_camera.as_ref(),
        })?;
        if report.fused {
            self.last_fused.replace(&job.features);
        }
        let fused = FusedPair {
            stamp_ns: job.pair.stamp_ns,
            sequence: job.pair.sequence,
            world_from_camera: job.world_from_camera,
            report,
            dense_ms: milliseconds_since(started),
        };
        sink.fused(&fused, &mut self.model)?;
        Ok(())
    }

    /// Once, on the first picture that shows anything.
    fn refuse_swapped_eyes(&mut self, job: &DenseJob) -> Result<(), WorkerError> {
        if self.eyes_are_checked || job.quality != FrameQuality::Good {
            return Ok(());
        }
        self.eyes_are_checked = true;
        let range = DisparityRange::of_rig(self.model.rig(), &self.disparity)?;
        let eyes = (&*job.pair.left, &job.pair.right);
        let order = dense::disparity::eye_order(&self.gpu, eyes, range, &self.disparity)?;
        if order.is_swapped() { Err(WorkerError::EyesSwapped) } else { Ok(()) }
    }
}

/// The right image with its rows where the left one's are; a tenth of a pixel changes nothing.
fn levelled(right: Rgb, row_offset_px: f64) -> Rgb {
    if row_offset_px.abs() < 0.1 { right } else { right.rows_shifted(row_offset_px) }
}

fn milliseconds_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
