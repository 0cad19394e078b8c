//! A session: its hub, and the pipeline from encoded pairs to the reconstruction and the journal.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use geometry::Pose;
use protocol::v1::{Reason, StereoPair};
use recording::{Calibration, RecordingConfig};

use super::engine::{Engine, EngineError, EngineResults, EngineStart, RunningEngine};
use super::history::History;
use super::hub::Hub;
use super::intake::Rejection;
use super::journal::{Entry, Journal, JournalOptions};
use super::lifecycle::{Closing, Event, SourceId};
use super::mailbox::{MailboxSender, Offer, Policy, mailbox};
use super::replay_source::ReplayControl;
use super::results;
use crate::ingest::decode::{self, Incoming};
use crate::picture::{PictureError, PictureInlet};
use crate::storage::{Run, RunInfo, Storage};

/// What sessions of one server have in common.
#[derive(Clone)]
pub struct SessionParts {
    /// Computes.
    pub engine: Arc<dyn Engine>,
    /// Where journals and results go; `None` where nothing is kept.
    pub storage: Option<Arc<Storage>>,
    /// Format of journals.
    pub recording: RecordingConfig,
}

/// What one session is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionOptions {
    /// Its recording is kept.
    pub record: bool,
    /// Whether its pairs may be passed over by newer ones; not those of a replay as fast as can be, which gives the same
    /// model each time.
    pub policy: Policy,
    /// Whether its pairs are journaled: not those of a replay, which are on the disk already.
    pub inputs: bool,
}

/// How a run starts.
pub enum RunStart {
    /// Empty.
    New,
    /// After a crash, from what the run's journal holds.
    Recovered {
        /// The run that the crash left.
        run: Run,
        /// The pose of the first pair that is worked through again.
        world_from_start: Pose,
    },
}

/// A session that a cart or a recording feeds and viewers follow.
pub struct Session {
    hub: Arc<Hub>,
    parts: SessionParts,
    options: SessionOptions,
    /// Where encoded pairs go in; `None` while the pipeline is rebuilt or gone.
    inlet: Mutex<Option<MailboxSender<Incoming>>>,
    pipeline: Mutex<Option<Pipeline>>,
    /// Where pictures are asked for, while the pipeline runs.
    pictures: Mutex<Option<PictureInlet>>,
    replay: Mutex<Option<Arc<ReplayControl>>>,
}

/// The threads behind the inlet; they end one after the other once it is gone.
struct Pipeline {
    calibration: Calibration,
    decoder: JoinHandle<()>,
    engine: Box<dyn RunningEngine>,
    run: Option<(Run, Option<Journal>)>,
}

impl Session {
    /// Starts the reconstruction. Blocks while it is built: not for the async runtime.
    ///
    /// # Errors
    /// As [`Engine::start`].
    pub fn start(
        hub: Hub,
        parts: SessionParts,
        options: SessionOptions,
        (calibration, start): (&Calibration, RunStart),
    ) -> Result<Self, EngineError> {
        let session = Self {
            hub: Arc::new(hub),
            parts,
            options,
            inlet: Mutex::new(None),
            pipeline: Mutex::new(None),
            pictures: Mutex::new(None),
            replay: Mutex::new(None),
        };
        session.build(&mut lock(&session.pipeline), calibration, start)?;
        Ok(session)
    }

    /// What all who deal with the session share.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// Where pictures of the model are asked for.
    ///
    /// # Errors
    /// [`PictureError::NoModel`] while the reconstruction is rebuilt or gone.
    pub fn pictures(&self) -> Result<PictureInlet, PictureError> {
        lock(&self.pictures).clone().ok_or(PictureError::NoModel)
    }

    /// The switch of the recording that is replayed; `None` in a session that a cart feeds.
    pub fn replay(&self) -> Option<Arc<ReplayControl>> {
        lock(&self.replay).clone()
    }

    /// The session is fed by a recording from now on.
    pub fn set_replay(&self, control: Arc<ReplayControl>) {
        *lock(&self.replay) = Some(control);
    }

    /// The cameras give other images from now on; the same calibration again changes nothing. Blocks.
    ///
    /// # Errors
    /// As [`Engine::start`]; the session is then held but takes no pairs until a calibration that works.
    pub fn recalibrate(&self, calibration: &Calibration) -> Result<(), EngineError> {
        let mut pipeline = lock(&self.pipeline);
        if pipeline.as_ref().is_some_and(|running| running.calibration == *calibration) {
            return Ok(());
        }
        self.tear_down(&mut pipeline, RunEnd::Finished);
        let cleared = self.hub.recalibrate(calibration.image_size_px()).map_err(|error| error.to_string());
        let built = cleared
            .and_then(|()| self.build(&mut pipeline, calibration, RunStart::New).map_err(|error| error.0));
        built.map_err(|text| {
            self.hub.fail(text.clone());
            EngineError(text)
        })
    }

    /// Starts the model anew, for another place of a recording; what was made of the last one is forgotten. Blocks.
    ///
    /// # Errors
    /// As [`Engine::start`].
    pub fn restart(&self, calibration: &Calibration) -> Result<(), EngineError> {
        let mut pipeline = lock(&self.pipeline);
        self.tear_down(&mut pipeline, RunEnd::Discarded);
        self.hub.restart(calibration.image_size_px()).map_err(|error| EngineError(error.to_string()))?;
        self.build(&mut pipeline, calibration, RunStart::New)
    }

    /// Takes a pair from a cart; returns at once. The newest pair wins.
    ///
    /// # Errors
    /// [`Rejection`], already counted.
    pub fn offer(&self, source: &SourceId, pair: StereoPair) -> Result<(), Rejection> {
        self.take(source, pair, Policy::NewestWins)
    }

    /// Takes a pair; under [`Policy::Lossless`] waits until there is room for it.
    ///
    /// # Errors
    /// [`Rejection`], already counted.
    pub fn take(&self, source: &SourceId, pair: StereoPair, policy: Policy) -> Result<(), Rejection> {
        self.hub.admit(source, &pair)?;
        // A clone shares the images' bytes.
        if self.options.inputs {
            self.hub.write_down(policy, Entry::Pair(pair.clone()));
        }
        let inlet = lock(&self.inlet).clone();
        match inlet.map_or(Offer::Closed, |inlet| inlet.offer_by(policy, Incoming { pair, policy })) {
            Offer::Queued => Ok(()),
            Offer::Superseded => {
                self.hub.count_drop(Reason::Superseded);
                Ok(())
            }
            Offer::Closed => {
                self.hub.count_drop(Reason::Internal);
                Err(Rejection::new(
                    Reason::Internal,
                    "the reconstruction does not run; see the session's state",
                ))
            }
        }
    }

    /// Ends the session: all who follow it are told, the reconstruction is waited for, results are written. Blocks.
    pub fn close(&self, closing: Closing) {
        self.hub.happen(Event::Close(closing));
        if let Some(replay) = lock(&self.replay).take() {
            replay.stop();
        }
        self.tear_down(&mut lock(&self.pipeline), RunEnd::Finished);
    }

    fn build(
        &self,
        pipeline: &mut Option<Pipeline>,
        calibration: &Calibration,
        start: RunStart,
    ) -> Result<(), EngineError> {
        let (run, world_from_start) = match start {
            RunStart::New => (self.begin_run(), Pose::identity()),
            RunStart::Recovered { run, world_from_start } => (Some(run), world_from_start),
        };
        let (encoded_in, encoded_out) = mailbox(Policy::NewestWins, 1);
        let (decoded_in, decoded_out) = mailbox(Policy::NewestWins, 1);
        let history = run.as_ref().and_then(|run| self.history(run));
        let engine_start = EngineStart {
            calibration,
            policy: self.options.policy,
            world_from_start,
            history: history.as_ref(),
        };
        let engine = self.parts.engine.start(&engine_start, decoded_out, Arc::clone(&self.hub))?;
        let decoder =
            decode::spawn(encoded_out, decoded_in, calibration.image_size_px(), Arc::clone(&self.hub))
                .map_err(|error| EngineError(format!("cannot start the decoder thread: {error}")))?;
        let run = run.map(|run| {
            let journal = self.start_journal(&run, calibration);
            (run, journal)
        });
        *lock(&self.pictures) = engine.pictures();
        *pipeline = Some(Pipeline { calibration: *calibration, decoder, engine, run });
        *lock(&self.inlet) = Some(encoded_in);
        Ok(())
    }

    /// A session without a disk goes on, with an alarm.
    fn begin_run(&self) -> Option<Run> {
        let storage = self.parts.storage.as_ref()?;
        let begun = storage.begin(RunInfo {
            session: self.hub.id().to_string(),
            takeover_token: self.hub.takeover_token().to_owned(),
            record: self.options.record,
            inputs: self.options.inputs,
        });
        begun.map_err(|error| self.hub.recording_failed(&format!("nothing is recorded: {error}"))).ok()
    }

    /// What a lost model is rebuilt from: the pairs in the journal, where it holds them.
    fn history(&self, run: &Run) -> Option<History> {
        let storage = self.parts.storage.as_ref().filter(|_| self.options.inputs)?;
        let (journal, recording) = (run.journal(), self.parts.recording.clone());
        Some(History { journal, recording, pairs_max: storage.config().rebuild_pairs_max })
    }

    fn start_journal(&self, run: &Run, calibration: &Calibration) -> Option<Journal> {
        let storage = self.parts.storage.as_ref()?;
        let options = JournalOptions {
            path: run.journal(),
            recording: self.parts.recording.clone(),
            free_min_mib: storage.config().free_min_mib,
        };
        match Journal::start(options, calibration, Arc::clone(&self.hub)) {
            Ok((journal, inlet)) => {
                self.hub.set_recording(self.options.record);
                self.hub.set_journal(Some(inlet));
                Some(journal)
            }
            Err(error) => {
                self.hub.recording_failed(&format!("nothing is recorded: {error}"));
                None
            }
        }
    }

    fn tear_down(&self, pipeline: &mut Option<Pipeline>, end: RunEnd) {
        *lock(&self.inlet) = None;
        *lock(&self.pictures) = None;
        let Some(pipeline) = pipeline.take() else { return };
        if pipeline.decoder.join().is_err() {
            tracing::error!(session = %self.hub.id(), "the decoder thread panicked");
        }
        let results = pipeline.engine.join();
        self.hub.set_journal(None);
        let Some((run, journal)) = pipeline.run else { return };
        match end {
            RunEnd::Finished => self.finish_run(run, journal, results.as_ref()),
            RunEnd::Discarded => {
                // Waits for the thread, so that it writes nowhere any more.
                let sealed = journal.map_or(Ok(()), |journal| journal.seal(&[]));
                tracing::debug!(?sealed, "a journal is discarded");
                run.discard();
            }
        }
    }

    fn finish_run(&self, run: Run, journal: Option<Journal>, results: Option<&EngineResults>) {
        let Some(storage) = &self.parts.storage else { return };
        if let Err(error) = results::finish(run, journal, results, (storage, &self.parts.recording)) {
            tracing::error!(session = %self.hub.id(), %error, "the results are not complete");
        }
    }
}

/// What becomes of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RunEnd {
    Finished,
    Discarded,
}

/// The contents are whole between any two statements, so a panic elsewhere does not spoil them.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
