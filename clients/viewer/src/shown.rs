//! What a window shows: a model that came over the network, or one in the same process.

use std::time::Instant;

use geometry::viewpoint::Bounds;
use geometry::{Pinhole, Pose};
use gpu::{Gpu, GpuError};
use render::SurfelArrays;

use crate::Message;

/// What is known of the model at a moment.
#[derive(Clone, Debug, Default)]
pub struct Status {
    /// Where the model is; `None` while it is empty.
    pub bounds: Option<Bounds>,
    /// The scope's camera and where it is.
    pub scope: Option<(Pinhole, Pose)>,
    /// It should have changed and did not.
    pub is_stale: bool,
    /// It is too old to be shown.
    pub is_hidden: bool,
    /// What has to be said.
    pub message: Option<Message>,
    /// All of the model is there.
    pub is_complete: bool,
}

/// A model that can be drawn.
pub trait Shown {
    /// Weight of a surfel that is as sure as can be.
    fn weight_max(&self) -> f32;

    /// What is known of it now.
    fn status(&mut self, now: Instant) -> Status;

    /// The arrays to draw from, brought up to date.
    ///
    /// # Errors
    /// As [`Gpu::storage`].
    fn arrays(&mut self, gpu: &Gpu) -> Result<SurfelArrays, GpuError>;

    /// Calls `draw` while nobody else writes the arrays.
    fn in_turn(&self, draw: &mut dyn FnMut()) {
        draw();
    }
}
