//! A session's journal: what comes and what is found, written by a thread of its own, never waited for.
//!
//! At least each second everything so far is handed to the operating system, so that a killed server loses no more.
//! Where the disk fails, the journal ends with an alarm, and the reconstruction goes on without it.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use geometry::trajectory::StampedPose;
use protocol::v1::{EncodedImage, StereoPair};
use recording::export::PlySurfel;
use recording::{Calibration, RecordingConfig, RecordingError, RecordingWriter};

use super::hub::Hub;
use super::mailbox::{MailboxReceiver, MailboxSender, Policy, Taken, mailbox};
use crate::convert;
use crate::storage;

/// Pairs and poses that wait for the disk: a second and a half at 30 pairs a second.
const ENTRIES_WAITING_MAX: usize = 96;

/// Something to be written down.
#[derive(Debug)]
pub enum Entry {
    /// As the cart sent it.
    Pair(StereoPair),
    /// As it was published.
    Pose(StampedPose),
}

/// The end that entries are put in by.
pub type JournalInlet = MailboxSender<Entry>;

/// How a journal is written.
#[derive(Clone, Debug)]
pub struct JournalOptions {
    /// The file.
    pub path: PathBuf,
    /// Format.
    pub recording: RecordingConfig,
    /// The journal ends below this much free space.
    pub free_min_mib: u64,
}

/// A journal being written.
pub struct Journal {
    thread: JoinHandle<Option<Pen>>,
    path: PathBuf,
}

impl Journal {
    /// Creates the file and starts the thread, which ends when all inlets are gone.
    ///
    /// # Errors
    /// [`RecordingError`] where the file cannot be made.
    pub fn start(
        options: JournalOptions,
        calibration: &Calibration,
        hub: Arc<Hub>,
    ) -> Result<(Self, JournalInlet), RecordingError> {
        let writer = RecordingWriter::create(&options.path, &options.recording)?;
        let cameras = *calibration;
        let (inlet, entries) = mailbox(Policy::NewestWins, ENTRIES_WAITING_MAX);
        let path = options.path.clone();
        let thread = std::thread::Builder::new()
            .name("journal".into())
            .spawn(move || {
                run(Pen { writer, cameras: Some(cameras), last_pose_ns: 0 }, &entries, &options, &hub)
            })
            .map_err(|source| RecordingError::Io { path: path.clone(), source })?;
        Ok((Self { thread, path }, inlet))
    }

    /// Waits until all entries are written; adds the final model, under the stamp of the last pose, and the index. All
    /// inlets must be gone.
    ///
    /// # Errors
    /// [`RecordingError`]; a journal that has failed before has told so and is no error here.
    pub fn seal(self, model: &[PlySurfel]) -> Result<(), RecordingError> {
        let Ok(pen) = self.thread.join() else {
            tracing::error!(path = %self.path.display(), "the journal thread panicked");
            return Ok(());
        };
        let Some(Pen { mut writer, last_pose_ns, .. }) = pen else { return Ok(()) };
        if !model.is_empty() {
            writer.write_model(last_pose_ns, model)?;
        }
        writer.finish()
    }
}

/// The file, and the cameras until the first stamp under which they can be written is known.
struct Pen {
    writer: RecordingWriter,
    cameras: Option<Calibration>,
    /// Stamp of the newest pose written.
    last_pose_ns: u64,
}

fn run(mut pen: Pen, entries: &MailboxReceiver<Entry>, options: &JournalOptions, hub: &Hub) -> Option<Pen> {
    match write_all(&mut pen, entries, options) {
        Ok(()) => Some(pen),
        Err(problem) => {
            tracing::error!(session = %hub.id(), problem, "the recording has stopped");
            hub.recording_failed(&format!("the recording has stopped: {problem}"));
            // The writer ends its file as far as the disk lets it; what is there stays readable either way.
            None
        }
    }
}

fn write_all(
    pen: &mut Pen,
    entries: &MailboxReceiver<Entry>,
    options: &JournalOptions,
) -> Result<(), String> {
    let interval = Duration::from_millis(options.recording.flush_interval_ms);
    let directory = options.path.parent().unwrap_or(Path::new("."));
    let (mut flushed, mut written) = (Instant::now(), false);
    loop {
        match entries.take_within(interval.saturating_sub(flushed.elapsed())) {
            Taken::Value(entry) => {
                pen.write(entry).map_err(|error| error.to_string())?;
                written = true;
            }
            Taken::Nothing | Taken::Woken => {}
            Taken::Closed => return Ok(()),
        }
        if flushed.elapsed() < interval {
            continue;
        }
        if std::mem::take(&mut written) {
            pen.writer.flush().map_err(|error| error.to_string())?;
            storage::check_room(directory, options.free_min_mib).map_err(|error| error.to_string())?;
        }
        flushed = Instant::now();
    }
}

impl Pen {
    fn write(&mut self, entry: Entry) -> Result<(), RecordingError> {
        if let Some(cameras) = self.cameras.take() {
            self.writer.write_calibration(entry.stamp_ns(), &cameras)?;
        }
        match entry {
            Entry::Pose(pose) => {
                self.last_pose_ns = pose.stamp_ns;
                self.writer.write_pose(&pose)
            }
            Entry::Pair(pair) => self.write_pair(pair),
        }
    }

    fn write_pair(&mut self, pair: StereoPair) -> Result<(), RecordingError> {
        let stamp_ns = pair.stamp_ns;
        let image =
            |image: Option<EncodedImage>| image.and_then(|image| convert::image_from_wire(image).ok());
        let (left, right, mask) = (image(pair.left), image(pair.right), image(pair.mask));
        if let (Some(left), Some(right)) = (left, right) {
            self.writer.write_pair(stamp_ns, &left, &right)?;
        }
        mask.map_or(Ok(()), |mask| self.writer.write_mask(stamp_ns, &mask))
    }
}

impl Entry {
    fn stamp_ns(&self) -> u64 {
        match self {
            Self::Pair(pair) => pair.stamp_ns,
            Self::Pose(pose) => pose.stamp_ns,
        }
    }
}
