//! The measured surface of each frame.

use geometry::StereoRig;
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuError};

use super::measure_surface::{self, Triangulation};
use super::upload::Preprocess;
use crate::disparity::DisparityStage;
use crate::{DenseError, Observation};

/// Turns disparities into an [`Observation`].
#[derive(Debug)]
pub struct SurfaceStage {
    size: (u32, u32),
    measure: BoundKernel,
}

impl SurfaceStage {
    /// Joins the stages before it to `observation`.
    ///
    /// # Errors
    /// [`DenseError::ImageSize`] where `rig` has another size than `input`, and whatever the GPU refuses.
    pub fn new(
        gpu: &Gpu,
        rig: &StereoRig,
        input: &Preprocess,
        disparity: &DisparityStage,
        observation: &Observation,
    ) -> Result<Self, DenseError> {
        let expected = (rig.left.width_px, rig.left.height_px);
        let sizes = [("prepared", input.size()), ("observed", (observation.width, observation.height))];
        for (what, found) in sizes {
            if found != expected {
                return Err(DenseError::ImageSize { what, found, expected });
            }
        }
        let triangulation = Triangulation::new(rig);
        let measure =
            measure_surface::bind(gpu, &triangulation, disparity.planes(), input.left(), observation)?;
        Ok(Self { size: expected, measure })
    }

    /// Records depth, standard deviation, normals and colours.
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.stage("surface", |stage| stage.run(&self.measure, [self.size.0, self.size.1, 1]))
    }
}
