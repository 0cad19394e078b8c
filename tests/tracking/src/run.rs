//! Feeds recordings to trackers.

use std::path::Path;
use std::time::Duration;

use cpu_time::{ProcessTime, ThreadTime};
use geometry::{Gray, Mask, Pose, StereoRig};
use recording::{Calibration, RecordingConfig, RecordingReader, StereoMessage};
use tracking::{StereoFrame, Tracker, TrackingConfig, TrackingReport};

use crate::Error;
use crate::footage::progress;

/// A decoded pair.
#[derive(Clone)]
pub struct Pair {
    /// Time of both images.
    pub stamp_ns: u64,
    /// Left eye.
    pub left: Gray,
    /// Right eye.
    pub right: Gray,
    /// Instruments.
    pub mask: Option<Mask>,
}

/// What became of one pair.
pub struct Tracked {
    /// Time of the pair.
    pub stamp_ns: u64,
    /// What the tracker said.
    pub report: TrackingReport,
    /// CPU time of the thread that called the tracker.
    pub thread: Duration,
    /// CPU time of all threads of the process.
    pub process: Duration,
}

/// A recording, opened.
pub struct Recording {
    reader: RecordingReader,
    /// The rectified cameras.
    pub rig: StereoRig,
}

impl Recording {
    /// Opens a recording of rectified images.
    ///
    /// # Errors
    /// What cannot be read, or is not rectified.
    pub fn open(path: &Path, config: &RecordingConfig) -> Result<Self, Error> {
        let reader = RecordingReader::open(path, config)?;
        match reader.calibration()? {
            Calibration::Rectified(rig) => Ok(Self { reader, rig }),
            Calibration::Raw(_) => Err(format!("{} is not rectified", path.display()).into()),
        }
    }

    /// The truth and whatever else it holds.
    pub fn reader(&self) -> &RecordingReader {
        &self.reader
    }

    /// Decoded pairs in the order of time.
    ///
    /// # Errors
    /// What cannot be read.
    pub fn pairs(&self) -> Result<impl Iterator<Item = Result<Pair, Error>>, Error> {
        let size_px = (self.rig.left.width_px, self.rig.left.height_px);
        Ok(self.reader.stereo()?.map(move |message| decode(&message?, size_px)))
    }

    /// True poses by pair; `None` where one is missing.
    ///
    /// # Errors
    /// What cannot be read.
    pub fn truth(&self, stamps_ns: &[u64]) -> Result<Vec<Option<Pose>>, Error> {
        let poses = self.reader.poses()?;
        let at = |stamp_ns: &u64| {
            let pose = poses.iter().find(|pose| pose.stamp_ns == *stamp_ns)?;
            Some(pose.world_from_camera)
        };
        Ok(stamps_ns.iter().map(at).collect())
    }
}

fn decode(message: &StereoMessage, size_px: (u32, u32)) -> Result<Pair, Error> {
    let gray = |image| recording::decode_rgb(image, size_px).map(|rgb| rgb.to_gray());
    let mask = message.mask.as_ref().map(|mask| recording::decode_gray(mask, size_px)).transpose()?;
    Ok(Pair { stamp_ns: message.stamp_ns, left: gray(&message.left)?, right: gray(&message.right)?, mask })
}

/// Tracks a whole recording.
///
/// # Errors
/// What cannot be read or tracked.
pub fn track_all(name: &str, recording: &Recording, config: &TrackingConfig) -> Result<Vec<Tracked>, Error> {
    let mut bench = Bench::new(&recording.rig, config)?;
    let bar = progress(name, recording.reader.expected_pairs().unwrap_or(0));
    let mut tracked = Vec::new();
    for pair in recording.pairs()? {
        tracked.push(bench.track(&pair?)?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(tracked)
}

/// A tracker whose CPU time is measured.
///
/// It is called from a thread of the pool that it computes in: so the caller does its share of the parallel work itself, and
/// its CPU time is that of the longest chain of work, not that of somebody who waits.
pub struct Bench {
    tracker: Tracker,
    pool: rayon::ThreadPool,
}

/// Left and right eye.
const THREADS: usize = 2;

impl Bench {
    /// A tracker without a map.
    ///
    /// # Errors
    /// A rig or configuration that it refuses.
    pub fn new(rig: &StereoRig, config: &TrackingConfig) -> Result<Self, Error> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(THREADS).build()?;
        Ok(Self { tracker: Tracker::new(config, rig)?, pool })
    }

    /// Keyframes in the map.
    pub fn keyframes(&self) -> usize {
        self.tracker.map().keyframe_count()
    }

    /// Tracks one pair.
    ///
    /// # Errors
    /// A pair that the tracker refuses.
    pub fn track(&mut self, pair: &Pair) -> Result<Tracked, Error> {
        let Pair { stamp_ns, left, right, mask } = pair;
        let frame = StereoFrame { stamp_ns: *stamp_ns, left, right, mask: mask.as_ref() };
        let (pool, tracker) = (&self.pool, &mut self.tracker);
        let process = ProcessTime::now();
        let (report, thread) = pool.install(|| {
            let thread = ThreadTime::now();
            (tracker.track(&frame), thread.elapsed())
        });
        let (report, process) = (report?, process.elapsed());
        Ok(Tracked { stamp_ns: *stamp_ns, report, thread, process })
    }
}
