//! All sessions of this server: opened, found, closed.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use geometry::GeometryError;
use geometry::validate::RigLimits;
use protocol::SessionId;
use protocol::v1::{Calibration, Reason, SessionStatus};
use recording::{Calibration as Cameras, RecordingConfig};
use tokio::sync::watch;

use super::SessionConfig;
use super::engine::Engine;
use super::hub::Hub;
use super::intake::Rejection;
use super::lifecycle::{Closing, Event, SourceId};
use super::live::{RunStart, Session, SessionOptions, SessionParts};
use super::mailbox::Policy;
use super::recovery::LeftJournal;
use super::replay_source::{ReplayControl, ReplaySource};
use crate::convert;
use crate::publish::PublishConfig;
use crate::random;
use crate::storage::{Run, Storage};

/// Random bytes of an id or token that the server makes.
const RANDOM_BYTES: usize = 16;
/// What everybody is told then.
const SHUTTING_DOWN: &str = "the server is shutting down";

/// What the registry is made from.
#[derive(Clone, Debug)]
pub struct RegistryConfig {
    /// Life times and limits.
    pub session: SessionConfig,
    /// Lanes.
    pub publish: PublishConfig,
    /// Which calibrations are believed.
    pub rig: RigLimits,
    /// Format and topics of journals and recordings.
    pub recording: RecordingConfig,
}

/// A session that somebody wants.
#[derive(Clone, Debug)]
pub struct Opening {
    /// Its id; the server makes one where none is wanted.
    pub id: Option<SessionId>,
    /// Whether its recording is kept.
    pub record: bool,
    /// Where its pairs come from.
    pub feed: FeedWanted,
}

/// Where a session's pairs come from.
#[derive(Clone, Debug)]
pub enum FeedWanted {
    /// From a cart with these cameras.
    Cart(Box<Calibration>),
    /// From a stored recording.
    Replay {
        /// Its name.
        recording: String,
        /// Times the recorded pace; 0: as fast as pairs are taken.
        rate: f64,
        /// Whether it waits before its first pair.
        paused: bool,
    },
}

/// The open sessions.
pub struct Registry {
    config: RegistryConfig,
    engine: Arc<dyn Engine>,
    storage: Option<Arc<Storage>>,
    sessions: Mutex<BTreeMap<SessionId, Arc<Session>>>,
    /// One reconstruction is built at a time, so that no limit is passed by two at once.
    opening: Mutex<()>,
    draining: AtomicBool,
    /// Counts openings and closings.
    changed: watch::Sender<u64>,
}

impl Registry {
    /// No session yet.
    pub fn new(config: RegistryConfig, engine: Arc<dyn Engine>, storage: Option<Arc<Storage>>) -> Self {
        Self {
            config,
            engine,
            storage,
            sessions: Mutex::default(),
            opening: Mutex::default(),
            draining: AtomicBool::new(false),
            changed: watch::Sender::new(0),
        }
    }

    /// What is kept on the disk; `None` where nothing is.
    pub fn storage(&self) -> Option<&Arc<Storage>> {
        self.storage.as_ref()
    }

    /// What computes and draws.
    pub fn engine(&self) -> &Arc<dyn Engine> {
        &self.engine
    }

    /// Format and topics of recordings.
    pub fn recording_config(&self) -> &RecordingConfig {
        &self.config.recording
    }

    fn sessions(&self) -> MutexGuard<'_, BTreeMap<SessionId, Arc<Session>>> {
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens a session. Blocks while the reconstruction is built.
    ///
    /// # Errors
    /// [`Rejection`]: draining, full, the id is taken, or the calibration or recording cannot be used.
    pub fn open(&self, opening: &Opening) -> Result<Arc<Session>, Rejection> {
        let _one_at_a_time = self.opening.lock().unwrap_or_else(PoisonError::into_inner);
        let id = opening.id.clone().map_or_else(random_id, Ok)?;
        self.check_room(&id)?;
        match &opening.feed {
            FeedWanted::Cart(calibration) => {
                let cameras = convert::calibration_from_wire(calibration, &self.config.rig)?;
                let options =
                    SessionOptions { record: self.keeps(opening), policy: Policy::NewestWins, inputs: true };
                let hub = self.hub(&id, random_text()?, &cameras);
                self.start(hub, options, (&cameras, RunStart::New))
            }
            FeedWanted::Replay { recording, rate, paused } => {
                let policy = if *rate == 0.0 { Policy::Lossless } else { Policy::NewestWins };
                let options = SessionOptions { record: self.keeps(opening), policy, inputs: false };
                self.open_replay(&id, options, recording, ReplayControl::new(*rate, *paused))
            }
        }
    }

    fn keeps(&self, opening: &Opening) -> bool {
        opening.record || self.storage.as_ref().is_some_and(|storage| storage.config().record_all)
    }

    fn open_replay(
        &self,
        id: &SessionId,
        options: SessionOptions,
        name: &str,
        control: Arc<ReplayControl>,
    ) -> Result<Arc<Session>, Rejection> {
        let unknown = || Rejection::new(Reason::UnknownRecording, format!("no recording {name}"));
        let path = self.storage.as_ref().and_then(|storage| storage.recording(name)).ok_or_else(unknown)?;
        let source = ReplaySource::open(name, &path, &self.config.recording)
            .map_err(|error| Rejection::new(Reason::InvalidRecording, error.to_string()))?;
        let cameras = *source.calibration();
        check_cameras(&cameras, &self.config.rig)
            .map_err(|error| Rejection::new(Reason::InvalidCalibration, error.to_string()))?;
        let hub = self.hub(id, random_text()?, &cameras);
        let session = self.start(hub, options, (&cameras, RunStart::New))?;
        session.hub().join(SourceId::Replay, "")?;
        session.set_replay(Arc::clone(&control));
        source
            .feed(&session, control)
            .map_err(|error| Rejection::new(Reason::Internal, error.to_string()))?;
        Ok(session)
    }

    fn hub(&self, id: &SessionId, takeover_token: String, cameras: &Cameras) -> Hub {
        let configs = (&self.config.session, &self.config.publish);
        Hub::new(id.clone(), takeover_token, cameras.image_size_px(), configs)
    }

    fn start(
        &self,
        hub: Hub,
        options: SessionOptions,
        cameras_and_start: (&Cameras, RunStart),
    ) -> Result<Arc<Session>, Rejection> {
        let id = hub.id().clone();
        let parts = SessionParts {
            engine: Arc::clone(&self.engine),
            storage: self.storage.clone(),
            recording: self.config.recording.clone(),
        };
        let session = Session::start(hub, parts, options, cameras_and_start)
            .map_err(|error| Rejection::new(Reason::InvalidCalibration, error.0))?;
        let session = Arc::new(session);
        self.sessions().insert(id.clone(), Arc::clone(&session));
        tracing::info!(session = %id, "session opened");
        self.changed.send_modify(|changes| *changes += 1);
        Ok(session)
    }

    fn check_room(&self, id: &SessionId) -> Result<(), Rejection> {
        if self.is_draining() {
            return Err(Rejection::new(Reason::ShuttingDown, SHUTTING_DOWN));
        }
        let sessions = self.sessions();
        if sessions.contains_key(id) {
            return Err(Rejection::new(Reason::SessionBusy, format!("a session {id} is open already")));
        }
        let limit = self.config.session.sessions_max;
        if sessions.len() >= limit {
            let text = format!("{limit} sessions are open, the most that session.sessions_max allows");
            return Err(Rejection::new(Reason::TooManySessions, text));
        }
        Ok(())
    }

    /// Opens again what a crash left open; their journals are worked through on threads of their own. Blocks while
    /// the reconstructions are built.
    pub fn recover(&self) {
        let Some(storage) = &self.storage else { return };
        let runs = storage.left_open().unwrap_or_else(|error| {
            tracing::error!(%error, "nothing is recovered");
            Vec::new()
        });
        for run in runs {
            let session = run.info().session.clone();
            match self.recover_run(storage, run) {
                Ok(()) => tracing::info!(session, "recovering after a crash"),
                Err(text) => tracing::error!(session, text, "not recovered"),
            }
        }
    }

    fn recover_run(&self, storage: &Storage, run: Run) -> Result<(), String> {
        let info = run.info().clone();
        let id: SessionId = info.session.parse().map_err(|error| format!("{error}"))?;
        self.check_room(&id).map_err(|rejection| rejection.to_string())?;
        let left = match LeftJournal::open(&run, storage.config().recover_max_s, &self.config.recording) {
            Ok(left) => left,
            Err(error) => {
                // The crash came before the first pair was on the disk.
                run.discard();
                return Err(error.to_string());
            }
        };
        let hub = self.hub(&id, info.takeover_token, &left.calibration);
        hub.join(SourceId::Journal, "").map_err(|busy| busy.to_string())?;
        if let Some(lost) = &left.lost {
            hub.raise_alarm(lost);
        }
        let options = SessionOptions { record: info.record, policy: Policy::NewestWins, inputs: info.inputs };
        let (cameras, world_from_start) = (left.calibration, left.world_from_start);
        let start = RunStart::Recovered { run, world_from_start };
        let session =
            self.start(hub, options, (&cameras, start)).map_err(|rejection| rejection.to_string())?;
        let feeding = std::thread::Builder::new().name("recovery".into()).spawn(move || left.feed(&session));
        feeding.map(drop).map_err(|error| error.to_string())
    }

    /// Brings a new calibration to a session. Blocks.
    ///
    /// # Errors
    /// [`Rejection`] where it cannot be used; where it is not believed the session goes on with the old one.
    pub fn recalibrate(&self, session: &Session, calibration: &Calibration) -> Result<(), Rejection> {
        let calibration = convert::calibration_from_wire(calibration, &self.config.rig)?;
        session.recalibrate(&calibration).map_err(|error| Rejection::new(Reason::InvalidCalibration, error.0))
    }

    /// The session of this id.
    pub fn get(&self, id: &SessionId) -> Option<Arc<Session>> {
        self.sessions().get(id).cloned()
    }

    /// The session of an id as it came in.
    ///
    /// # Errors
    /// [`Rejection`]: no id, or none of an open session.
    pub fn find(&self, id: &str) -> Result<Arc<Session>, Rejection> {
        let id: SessionId =
            id.parse().map_err(|error| Rejection::new(Reason::InvalidSessionId, format!("{error}")))?;
        self.get(&id).ok_or_else(|| Rejection::unknown_session(&id))
    }

    /// All open sessions, by id.
    pub fn list(&self) -> Vec<Arc<Session>> {
        self.sessions().values().cloned().collect()
    }

    /// Tells when sessions open and close.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    /// Ends a session; all who follow it are told. Blocks until its reconstruction has ended.
    pub fn close(&self, session: &Arc<Session>, closing: Closing) {
        {
            let mut sessions = self.sessions();
            // Another session may have taken its id since.
            if sessions.get(session.hub().id()).is_some_and(|open| Arc::ptr_eq(open, session)) {
                sessions.remove(session.hub().id());
            }
        }
        self.changed.send_modify(|changes| *changes += 1);
        session.close(closing);
    }

    /// Whether no more sessions are taken.
    pub fn is_draining(&self) -> bool {
        self.draining.load(Ordering::Relaxed)
    }

    /// Takes no more sessions and tells all who follow the open ones that they end.
    pub fn start_draining(&self) {
        self.draining.store(true, Ordering::Relaxed);
        for session in self.list() {
            session.hub().happen(Event::Close(Closing::because(SHUTTING_DOWN)));
        }
    }

    /// Ends all sessions at once. Blocks until their reconstructions have ended and their results are written.
    pub fn drain(&self) {
        self.start_draining();
        let sessions = self.list();
        std::thread::scope(|scope| {
            for session in &sessions {
                scope.spawn(|| self.close(session, Closing::because(SHUTTING_DOWN)));
            }
        });
    }

    /// Lets time pass: silence and age are noticed, states published. Gives the sessions that ended.
    pub fn tick(&self) -> Vec<Arc<Session>> {
        let sessions = self.list();
        for session in &sessions {
            session.hub().happen(Event::Tick);
            session.hub().publish_state();
        }
        sessions.into_iter().filter(|session| session.hub().status() == SessionStatus::Closed).collect()
    }
}

fn check_cameras(cameras: &Cameras, limits: &RigLimits) -> Result<(), GeometryError> {
    match cameras {
        Cameras::Rectified(rig) => geometry::validate::check_rig(rig, limits),
        Cameras::Raw(raw) => geometry::validate::check_calibration(raw, limits),
    }
}

fn random_id() -> Result<SessionId, Rejection> {
    random_text()?.parse().map_err(|error| Rejection::new(Reason::Internal, format!("{error}")))
}

/// Opaque, and not to be guessed.
fn random_text() -> Result<String, Rejection> {
    random::hex::<RANDOM_BYTES>()
        .map_err(|error| Rejection::new(Reason::Internal, format!("no random numbers: {error}")))
}
