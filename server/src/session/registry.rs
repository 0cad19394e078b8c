//! All sessions of this server: opened, found, closed.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use geometry::validate::RigLimits;
use protocol::SessionId;
use protocol::v1::{Calibration, Reason, SessionStatus};
use tokio::sync::watch;

use super::SessionConfig;
use super::engine::Engine;
use super::hub::Hub;
use super::intake::Rejection;
use super::lifecycle::Event;
use super::live::Session;
use crate::convert;
use crate::publish::PublishConfig;

/// Random bits of an id that the server makes.
const ID_BYTES: usize = 12;

/// What the registry is made from.
#[derive(Clone, Debug)]
pub struct RegistryConfig {
    /// Life times and limits.
    pub session: SessionConfig,
    /// Lanes.
    pub publish: PublishConfig,
    /// Which calibrations are believed.
    pub rig: RigLimits,
}

/// The open sessions.
pub struct Registry {
    config: RegistryConfig,
    engine: Arc<dyn Engine>,
    sessions: Mutex<BTreeMap<SessionId, Arc<Session>>>,
    /// One reconstruction is built at a time, so that no limit is passed by two at once.
    opening: Mutex<()>,
    draining: AtomicBool,
    /// Counts openings and closings.
    changed: watch::Sender<u64>,
}

impl Registry {
    /// No session yet.
    pub fn new(config: RegistryConfig, engine: Arc<dyn Engine>) -> Self {
        Self {
            config,
            engine,
            sessions: Mutex::default(),
            opening: Mutex::default(),
            draining: AtomicBool::new(false),
            changed: watch::Sender::new(0),
        }
    }

    fn sessions(&self) -> MutexGuard<'_, BTreeMap<SessionId, Arc<Session>>> {
        self.sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens a session; makes an id where none is wanted. Blocks while the reconstruction is built.
    ///
    /// # Errors
    /// [`Rejection`]: draining, full, the id is taken, or the calibration cannot be used.
    pub fn open(
        &self,
        wanted: Option<SessionId>,
        calibration: &Calibration,
    ) -> Result<Arc<Session>, Rejection> {
        let _one_at_a_time = self.opening.lock().unwrap_or_else(PoisonError::into_inner);
        let id = wanted.map_or_else(random_id, Ok)?;
        self.check_room(&id)?;
        let calibration = convert::calibration_from_wire(calibration, &self.config.rig)?;
        let hub =
            Hub::new(id.clone(), calibration.image_size_px(), &self.config.session, &self.config.publish);
        let session = Session::start(hub, Arc::clone(&self.engine), &calibration)
            .map_err(|error| Rejection::new(Reason::InvalidCalibration, error.0))?;
        let session = Arc::new(session);
        self.sessions().insert(id.clone(), Arc::clone(&session));
        tracing::info!(session = %id, "session opened");
        self.changed.send_modify(|changes| *changes += 1);
        Ok(session)
    }

    fn check_room(&self, id: &SessionId) -> Result<(), Rejection> {
        if self.is_draining() {
            return Err(Rejection::new(Reason::ShuttingDown, "the server is shutting down"));
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
        self.get(&id).ok_or_else(|| Rejection::new(Reason::UnknownSession, format!("no session {id}")))
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
    pub fn close(&self, session: &Arc<Session>, text: &str) {
        {
            let mut sessions = self.sessions();
            // Another session may have taken its id since.
            if sessions.get(session.hub().id()).is_some_and(|open| Arc::ptr_eq(open, session)) {
                sessions.remove(session.hub().id());
            }
        }
        self.changed.send_modify(|changes| *changes += 1);
        session.close(text);
    }

    /// Whether no more sessions are taken.
    pub fn is_draining(&self) -> bool {
        self.draining.load(Ordering::Relaxed)
    }

    /// Takes no more sessions and tells all who follow the open ones that they end.
    pub fn start_draining(&self) {
        self.draining.store(true, Ordering::Relaxed);
        for session in self.list() {
            session.hub().happen(Event::Close("the server is shutting down".into()));
        }
    }

    /// Ends all sessions. Blocks until their reconstructions have ended.
    pub fn drain(&self) {
        self.start_draining();
        for session in self.list() {
            self.close(&session, "the server is shutting down");
        }
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

/// Opaque, and not to be guessed.
fn random_id() -> Result<SessionId, Rejection> {
    let internal = |text: String| Rejection::new(Reason::Internal, text);
    let mut bytes = [0; ID_BYTES];
    getrandom::fill(&mut bytes).map_err(|error| internal(format!("no random numbers: {error}")))?;
    let text: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    text.parse().map_err(|error| internal(format!("{error}")))
}
