//! The measured surface of each frame.

use geometry::StereoRig;
use gpu::{BoundKernel, FrameRecorder, Gpu, GpuBuffer, GpuError};

use super::measure_surface::{self, Triangulation};
use super::upload::Preprocess;
use crate::disparity::{DisparityConfig, DisparityStage};
use crate::{DenseError, Observation};

/// Turns disparities into an [`Observation`].
#[derive(Debug)]
pub struct SurfaceStage {
    size: (u32, u32),
    rig: StereoRig,
    incidence_max_deg: f64,
    triangulation: GpuBuffer<Triangulation>,
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
        config: &DisparityConfig,
    ) -> Result<Self, DenseError> {
        let expected = (rig.left.width_px, rig.left.height_px);
        let sizes = [("prepared", input.size()), ("observed", (observation.width, observation.height))];
        for (what, found) in sizes {
            if found != expected {
                return Err(DenseError::ImageSize { what, found, expected });
            }
        }
        let triangulation =
            gpu.uniform("triangulation", &Triangulation::new(rig, 0.0, config.incidence_max_deg))?;
        let measure =
            measure_surface::bind(gpu, &triangulation, disparity.planes(), input.left(), observation)?;
        let incidence_max_deg = config.incidence_max_deg;
        Ok(Self { size: expected, rig: *rig, incidence_max_deg, triangulation, measure })
    }

    /// From the next frame on, `drift_px` is taken off every disparity.
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn set_drift(&self, gpu: &Gpu, drift_px: f64) -> Result<(), GpuError> {
        gpu.write(&self.triangulation, 0, &[Triangulation::new(&self.rig, drift_px, self.incidence_max_deg)])
    }

    /// Records depth, standard deviation, normals and colours.
    ///
    /// # Errors
    /// Whatever the GPU refuses.
    pub fn record(&self, frame: &mut FrameRecorder) -> Result<(), GpuError> {
        frame.stage("surface", |stage| stage.run(&self.measure, [self.size.0, self.size.1, 1]))
    }
}
