//! A live session: its hub, and the pipeline from encoded pairs to the reconstruction.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use protocol::v1::{Reason, StereoPair};
use recording::Calibration;

use super::engine::{Engine, EngineError, RunningEngine};
use super::hub::Hub;
use super::intake::Rejection;
use super::lifecycle::{Event, SourceId};
use super::mailbox::{MailboxSender, Offer, Policy, mailbox};
use crate::ingest::decode;

/// A session that carts feed and viewers follow.
pub struct Session {
    hub: Arc<Hub>,
    engine: Arc<dyn Engine>,
    /// Where encoded pairs go in; `None` while the pipeline is rebuilt or gone.
    inlet: Mutex<Option<MailboxSender<StereoPair>>>,
    pipeline: Mutex<Option<Pipeline>>,
}

/// The threads behind the inlet; they end one after the other once it is gone.
struct Pipeline {
    calibration: Calibration,
    decoder: JoinHandle<()>,
    engine: Box<dyn RunningEngine>,
}

impl Session {
    /// Starts the reconstruction. Blocks while it is built: not for the async runtime.
    ///
    /// # Errors
    /// As [`Engine::start`].
    pub fn start(hub: Hub, engine: Arc<dyn Engine>, calibration: &Calibration) -> Result<Self, EngineError> {
        let session =
            Self { hub: Arc::new(hub), engine, inlet: Mutex::new(None), pipeline: Mutex::new(None) };
        session.build(&mut lock(&session.pipeline), calibration)?;
        Ok(session)
    }

    /// What all who deal with the session share.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
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
        self.tear_down(&mut pipeline);
        let cleared = self.hub.recalibrate(calibration.image_size_px()).map_err(|error| error.to_string());
        let built = cleared.and_then(|()| self.build(&mut pipeline, calibration).map_err(|error| error.0));
        built.map_err(|text| {
            self.hub.fail(text.clone());
            EngineError(text)
        })
    }

    /// Takes a pair from a cart; returns at once. The newest pair wins.
    ///
    /// # Errors
    /// [`Rejection`], already counted.
    pub fn offer(&self, source: &SourceId, pair: StereoPair) -> Result<(), Rejection> {
        self.hub.admit(source, &pair)?;
        let offer = lock(&self.inlet).as_ref().map_or(Offer::Closed, |inlet| inlet.offer(pair));
        match offer {
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

    /// Ends the session: all who follow it are told, and the reconstruction is waited for. Blocks.
    pub fn close(&self, text: &str) {
        self.hub.happen(Event::Close(text.to_owned()));
        self.tear_down(&mut lock(&self.pipeline));
    }

    fn build(&self, pipeline: &mut Option<Pipeline>, calibration: &Calibration) -> Result<(), EngineError> {
        let (encoded_in, encoded_out) = mailbox(Policy::NewestWins, 1);
        let (decoded_in, decoded_out) = mailbox(Policy::NewestWins, 1);
        let engine = self.engine.start(calibration, decoded_out, Arc::clone(&self.hub))?;
        let decoder =
            decode::spawn(encoded_out, decoded_in, calibration.image_size_px(), Arc::clone(&self.hub))
                .map_err(|error| EngineError(format!("cannot start the decoder thread: {error}")))?;
        *pipeline = Some(Pipeline { calibration: *calibration, decoder, engine });
        *lock(&self.inlet) = Some(encoded_in);
        Ok(())
    }

    fn tear_down(&self, pipeline: &mut Option<Pipeline>) {
        *lock(&self.inlet) = None;
        let Some(pipeline) = pipeline.take() else { return };
        if pipeline.decoder.join().is_err() {
            tracing::error!(session = %self.hub.id(), "the decoder thread panicked");
        }
        pipeline.engine.join();
    }
}

/// The contents are whole between any two statements, so a panic elsewhere does not spoil them.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
