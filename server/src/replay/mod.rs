//! Replays a recording through the same worker as a live session and writes the results (design section 10).

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use dense::DenseError;
use geometry::{GeometryError, Pose};
use gpu::{Gpu, GpuError};
use recording::{Calibration, PairingStatistics, RecordingError, RecordingReader, StereoMessage};
use tracing::trace_span;

use crate::config::Config;
use crate::session::gpu_turns::GpuTurns;
use crate::session::mailbox::{MailboxSender, Offer, Policy, mailbox};
use crate::session::shared_gpu::SharedGpu;
use crate::session::worker::{self, StageConfig, StereoPair, WorkerError, WorkerSetup};

pub(crate) mod collector;
pub(crate) mod files;
mod frames;
mod points;
mod report;
mod seams;
mod stream;
mod tracking_rows;
pub(crate) mod truth;

use collector::{Collector, Running};
pub use frames::FrameRow;
pub(crate) use report::quantiles;
pub use report::{FrameCounts, Report};
use stream::StreamMeter;
use truth::PointTruth;

/// How fast pairs are fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Pace {
    /// As fast as they can be worked on; nothing is dropped and the result is the same each time.
    Max,
    /// By their stamps, as live: what cannot be worked on in time is dropped and counted.
    Realtime,
}

impl Pace {
    fn policy(self) -> Policy {
        match self {
            Self::Max => Policy::Lossless,
            Self::Realtime => Policy::NewestWins,
        }
    }
}

/// What to replay, and where the results go.
#[derive(Clone, Debug)]
pub struct ReplayOptions {
    /// The recording.
    pub recording: PathBuf,
    /// The directory of the results; made where it is missing.
    pub out: PathBuf,
    /// How fast.
    pub pace: Pace,
    /// Also write the depth of each pair.
    pub save_depth: bool,
    /// Also write the model as the scope sees it, picture and depth, at every n-th pair.
    pub views_every: Option<NonZeroU32>,
    /// Also write each left image with the tracker's features into this directory.
    pub draw_features: Option<PathBuf>,
}

/// Why a replay ended without results.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The recording cannot be used.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording's cameras are refused.
    #[error("calibration of the recording: {0}")]
    Calibration(#[from] GeometryError),
    /// The recording holds no pair.
    #[error("{}: no stereo pair could be replayed ({reasons})", .path.display())]
    NoPairs {
        /// The recording.
        path: PathBuf,
        /// What became of its images.
        reasons: String,
    },
    /// The reconstruction refused or failed.
    #[error(transparent)]
    Worker(Arc<WorkerError>),
    /// No GPU.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Results could not be read back.
    #[error(transparent)]
    Dense(#[from] DenseError),
    /// A result file could not be written.
    #[error(transparent)]
    Results(RecordingError),
    /// `frames.csv` could not be written or read.
    #[error("{}: {source}", .path.display())]
    Frames {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: csv::Error,
    },
    /// A file or directory of the results could not be made.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file or directory.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl ReplayError {
    /// Whether the input is to blame (exit status 2) rather than the machine.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Recording(_) | Self::Calibration(_) | Self::NoPairs { .. } => true,
            Self::Worker(error) => matches!(**error, WorkerError::Calibration(_) | WorkerError::EyesSwapped),
            _ => false,
        }
    }

    fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }
}

impl ReplayOptions {
    fn running(&self) -> Running {
        Running {
            depth_directory: self.save_depth.then(|| self.out.join("depth")),
            views: self.views_every.map(|every| (self.out.join("views"), every)),
            feature_directory: self.draw_features.clone(),
        }
    }
}

impl From<WorkerError> for ReplayError {
    fn from(error: WorkerError) -> Self {
        Self::Worker(Arc::new(error))
    }
}

/// Replays a recording. `progress` is told pairs done and, where known, in all.
///
/// # Errors
/// [`ReplayError`]; bad pairs are counted in the report, not errors.
pub fn replay(
    options: &ReplayOptions,
    config: &Config,
    progress: &mut dyn FnMut(u64, Option<u64>),
) -> Result<Report, ReplayError> {
    let started = Instant::now();
    let reader = RecordingReader::open(&options.recording, &config.recording)?;
    let calibration = checked_calibration(&reader, config)?;
    files::make_directories(options)?;
    let gpu = Arc::new(Gpu::open(&config.gpu.clone().with_environment())?);
    let stream = StreamMeter::new(config.publish.lag_limits(), config.dense.fusion.weight_max);
    let truth = PointTruth::load(&reader)?;
    let collector = Arc::new(Collector::new(options.running(), Some(stream), truth));
    let stages = StageConfig::from(config);
    let turns = GpuTurns::new(Duration::from_secs_f64(config.session.gpu_quantum_ms * 1e-3));
    let setup = WorkerSetup {
        stages: &stages,
        calibration: &calibration,
        policy: options.pace.policy(),
        gpu_turns: &turns,
        history: None,
        world_from_start: Pose::identity(),
    };
    let shared = Arc::new(SharedGpu::new(Arc::clone(&gpu), config.gpu.clone().with_environment()));
    let (sender, receiver) = mailbox(options.pace.policy(), 2);
    let running = worker::spawn(&setup, shared, receiver, Arc::clone(&collector) as _)?;
    let statistics = feed(&reader, options.pace, &calibration, &sender, &collector, progress);
    drop(sender);
    running.join();
    let collected = Arc::into_inner(collector).expect("the worker has let go of it").into_collected();
    if let Some(error) = collected.error {
        return Err(ReplayError::Worker(error));
    }
    let statistics = statistics?;
    if collected.counts.tracked + collected.counts.lost == 0 {
        let reasons = describe(&statistics, &collected.reasons);
        return Err(ReplayError::NoPairs { path: options.recording.clone(), reasons });
    }
    let run = files::Run {
        gpu: &gpu,
        recording: Some(&options.recording),
        statistics: &statistics,
        truncated: reader.truncated(),
        wall: started.elapsed(),
    };
    files::write(&options.out, &collected, &run)
}

fn checked_calibration(reader: &RecordingReader, config: &Config) -> Result<Calibration, ReplayError> {
    let calibration = reader.calibration()?;
    match &calibration {
        Calibration::Rectified(rig) => geometry::validate::check_rig(rig, &config.rig)?,
        Calibration::Raw(raw) => geometry::validate::check_calibration(raw, &config.rig)?,
    }
    Ok(calibration)
}

/// Puts every pair into the mailbox; damaged ones are counted and left out.
fn feed(
    reader: &RecordingReader,
    pace: Pace,
    calibration: &Calibration,
    sender: &MailboxSender<StereoPair>,
    collector: &Collector,
    progress: &mut dyn FnMut(u64, Option<u64>),
) -> Result<PairingStatistics, ReplayError> {
    let mut messages = reader.stereo()?;
    let mut clock = PaceClock::new(pace);
    let policy = pace.policy();
    let mut number = 0u64;
    for message in messages.by_ref() {
        let message = message?;
        clock.wait_for(message.stamp_ns);
        let _pair = trace_span!("read pair", frame = number).entered();
        let size_px = calibration.image_size_px();
        match trace_span!("decode").in_scope(|| decode(&message, (number, policy), size_px)) {
            Err(error) => collector.count_drop("malformed_image", &error.to_string()),
            Ok(pair) => match trace_span!("hand over").in_scope(|| sender.offer(pair)) {
                Offer::Queued => {}
                Offer::Superseded => collector.count_drop("superseded", "a newer pair came first"),
                Offer::Closed => break,
            },
        }
        number += 1;
        progress(number, reader.expected_pairs());
    }
    Ok(messages.statistics().clone())
}

fn decode(
    message: &StereoMessage,
    (sequence, policy): (u64, Policy),
    size_px: (u32, u32),
) -> Result<StereoPair, RecordingError> {
    let mask = message.mask.as_ref().map(|mask| recording::decode_gray(mask, size_px)).transpose()?;
    Ok(StereoPair {
        stamp_ns: message.stamp_ns,
        sequence,
        left: recording::decode_rgb(&message.left, size_px)?,
        right: recording::decode_rgb(&message.right, size_px)?,
        mask,
        policy,
    })
}

fn describe(statistics: &PairingStatistics, reasons: &std::collections::BTreeMap<String, u64>) -> String {
    let unpaired = format!(
        "{} left and {} right images without the other eye",
        statistics.unpaired_left, statistics.unpaired_right
    );
    let dropped = reasons.iter().map(|(reason, count)| format!(", {count} {reason}")).collect::<String>();
    unpaired + &dropped
}

/// Lets pairs through at the times their stamps tell.
struct PaceClock {
    realtime: bool,
    first: Option<(Instant, u64)>,
}

impl PaceClock {
    fn new(pace: Pace) -> Self {
        Self { realtime: pace == Pace::Realtime, first: None }
    }

    fn wait_for(&mut self, stamp_ns: u64) {
        let (start, first_ns) = *self.first.get_or_insert_with(|| (Instant::now(), stamp_ns));
        let due = start + Duration::from_nanos(stamp_ns.saturating_sub(first_ns));
        while self.realtime && Instant::now() < due {
            std::thread::park_timeout(due - Instant::now());
        }
    }
}

/// The collector's state stays usable whatever happened in another thread.
fn unpoisoned<T>(result: Result<T, PoisonError<T>>) -> T {
    result.unwrap_or_else(PoisonError::into_inner)
}
