//! Pictures of a session's model from any pose, and copies of it, made between two frames by the thread that holds it.

mod queue;

use dense::{Coloring, View};
use geometry::viewpoint::Bounds;
use geometry::{Pinhole, Pose};

pub use queue::{Answer, Answered, PictureInlet, PictureRequest, picture_queue};

/// A picture that somebody wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureWanted {
    /// Columns, rows.
    pub size_px: (u32, u32),
    /// Where it is taken from.
    pub viewpoint: Viewpoint,
    /// How it is coloured.
    pub coloring: Coloring,
}

/// Where a picture is taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Viewpoint {
    /// So that the whole model is seen, from the side that it faces.
    Overview,
    /// From where the scope last was.
    Scope,
    /// From anywhere.
    Pose {
        /// Maps camera points to world points.
        world_from_camera: Pose,
        /// Tangent of half the angle by which the shorter side opens.
        half_opening_tangent: f64,
    },
}

/// Why there is no picture, or no copy of the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PictureError {
    /// More are waited for than are kept waiting.
    #[error("{waiting} pictures or copies of this model are waited for already")]
    TooMany {
        /// How many.
        waiting: usize,
    },
    /// Nobody has it: the reconstruction has ended or is being rebuilt.
    #[error("the reconstruction is not there to show its model")]
    NoModel,
    /// The scope's place is not known.
    #[error("the scope's place is not known yet")]
    NoScope,
    /// The GPU refused.
    #[error("the GPU cannot draw or read the model: {0}")]
    Gpu(String),
}

impl PictureWanted {
    /// The camera; `scope` is the scope's own, and `bounds` that of the model, found only where it is needed.
    ///
    /// # Errors
    /// [`PictureError::NoScope`], and those of `bounds`.
    pub fn view(
        &self,
        scope: Option<(&Pinhole, &Pose)>,
        bounds: impl FnOnce() -> Result<Bounds, PictureError>,
    ) -> Result<View, PictureError> {
        let (pinhole, world_from_camera) = match self.viewpoint {
            Viewpoint::Overview => bounds()?.overview(self.size_px),
            Viewpoint::Scope => {
                let (camera, world_from_camera) = scope.ok_or(PictureError::NoScope)?;
                (camera.shown_in(self.size_px), *world_from_camera)
            }
            Viewpoint::Pose { world_from_camera, half_opening_tangent } => {
                (Pinhole::of_opening(self.size_px, half_opening_tangent), world_from_camera)
            }
        };
        Ok(View { pinhole, world_from_camera })
    }
}
