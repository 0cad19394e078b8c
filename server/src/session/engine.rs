//! What turns decoded pairs into poses and a model: the seam between sessions and their computation.

use std::sync::Arc;

use recording::Calibration;

use super::hub::Hub;
use super::mailbox::MailboxReceiver;
use super::worker::StereoPair;

/// Starts one computation per session.
pub trait Engine: Send + Sync + 'static {
    /// Starts on pairs of this calibration, which ends when all senders of `pairs` are gone. Results go to `hub`.
    /// May block for seconds.
    ///
    /// # Errors
    /// [`EngineError`] where the calibration, a configuration or the GPU refuses.
    fn start(
        &self,
        calibration: &Calibration,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError>;
}

/// A running computation.
pub trait RunningEngine: Send {
    /// Waits until everything put in has come out.
    fn join(self: Box<Self>);
}

/// Why a computation does not start.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct EngineError(pub String);
