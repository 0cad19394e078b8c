//! What is known of a session at a moment, for whoever draws it.

use std::sync::Arc;

use geometry::{Pinhole, Pose};
use protocol::v1::{SessionState, TrackingOutcome};
use render::SurfelRow;

use crate::age::DataAge;

/// A session as its viewer knows it.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// The surfels, by id.
    pub surfels: Arc<Vec<SurfelRow>>,
    /// Goes up with each change of the surfels.
    pub version: u64,
    /// The model is the server's at some epoch, whole.
    pub is_current: bool,
    /// How often the model had to be asked for again.
    pub resyncs: u64,
    /// The rectified left camera.
    pub camera: Option<Pinhole>,
    /// Where the scope last was.
    pub world_from_scope: Option<Pose>,
    /// Of the newest pose.
    pub tracking: TrackingOutcome,
    /// The newest state.
    pub state: SessionState,
    /// Of the model.
    pub model_age: DataAge,
    /// Messages come in.
    pub connected: bool,
    /// The server says that there is no such session.
    pub unknown_session: bool,
    /// What the server or the network said when the connection ended.
    pub notice: String,
}
