//! What turns decoded pairs into poses and a model: the seam between sessions and their computation.

use std::sync::Arc;

use geometry::{Pose, Rgb};
use recording::Calibration;
use recording::export::PlySurfel;

use super::history::History;
use super::hub::Hub;
use super::mailbox::{MailboxReceiver, Policy};
use super::worker::StereoPair;
use crate::picture::{PictureError, PictureInlet, PictureWanted};
use crate::replay::Report;

/// What a computation starts from.
#[derive(Clone, Copy)]
pub struct EngineStart<'a> {
    /// The cameras.
    pub calibration: &'a Calibration,
    /// Whether the same pairs must give the same map, or tracking must never wait for the mapping.
    pub policy: Policy,
    /// Where the first tracked camera is in the world; the identity unless an earlier session is gone on with.
    pub world_from_start: Pose,
    /// What a model that is lost with its GPU is rebuilt from, where it is kept.
    pub history: Option<&'a History>,
}

/// Starts one computation per session.
pub trait Engine: Send + Sync + 'static {
    /// Starts on pairs of this calibration, which ends when all senders of `pairs` are gone. Results go to `hub`.
    /// May block for seconds.
    ///
    /// # Errors
    /// [`EngineError`] where the calibration, a configuration or the GPU refuses.
    fn start(
        &self,
        start: &EngineStart,
        pairs: MailboxReceiver<StereoPair>,
        hub: Arc<Hub>,
    ) -> Result<Box<dyn RunningEngine>, EngineError>;

    /// A picture of a model that a session left behind. Blocks.
    ///
    /// # Errors
    /// [`PictureError`]; an engine without a GPU draws nothing.
    fn draw(&self, _model: &[PlySurfel], _wanted: &PictureWanted) -> Result<Rgb, PictureError> {
        Err(PictureError::NoModel)
    }
}

/// A running computation.
pub trait RunningEngine: Send {
    /// Where pictures of the model are asked for; `None` where there are none.
    fn pictures(&self) -> Option<PictureInlet> {
        None
    }

    /// Waits until everything put in has come out; gives what is left behind, if anything.
    fn join(self: Box<Self>) -> Option<EngineResults>;
}

/// What a computation leaves behind.
#[derive(Clone, Debug)]
pub struct EngineResults {
    /// The final model, by increasing id.
    pub model: Vec<PlySurfel>,
    /// A picture of it.
    pub picture: Option<Rgb>,
    /// Counts, times, errors.
    pub report: Report,
}

/// Why a computation does not start.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct EngineError(pub String);
