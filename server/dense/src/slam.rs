//! One stereo pair and the tracker's pose in, the model brought up to date: all stages of a frame in one submission.

use std::sync::Arc;

use geometry::{DepthMap, Mask, Pose, Rgb, StereoRig};
use gpu::{FrameRecorder, Gpu, StageTime};
use nalgebra::Point3;
use tracing::trace_span;

use crate::disparity::{DisparityConfig, DisparityRange, DisparityStage};
use crate::model::{DiscardReason, FusionReport, SurfelModel, WarpReport};
use crate::preprocess::{Preprocess, SurfaceStage};
use crate::render::{BACKGROUND, Coloring};
use crate::{
    BackProjection, ChangeSet, DenseConfig, DenseError, EncodingSteps, FrameCorrection, ModelArrays,
    Observation, Rendering, Surfel, View,
};

/// A rectified pair and what the tracker says of it.
#[derive(Clone, Copy, Debug)]
pub struct DenseFrame<'a> {
    /// Index of the frame in the session; ascends.
    pub index: u32,
    /// Time stamp.
    pub stamp_ns: u64,
    /// Left eye.
    pub left: &'a Rgb,
    /// Right eye.
    pub right: &'a Rgb,
    /// Instruments in the left eye.
    pub mask: Option<&'a Mask>,
    /// What the rig's disparities have too much in this frame, px; see the tracker's stereo drift.
    pub disparity_drift_px: f64,
    /// Points of tissue that the tracker found in the last fused frame and again in this one.
    pub correspondences: &'a [Correspondence],
    /// Where the tracker says the camera is, `None` while it is lost: then only the depth is found.
    pub camera: Option<TrackedCamera>,
}

/// The tracker's word on the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedCamera {
    /// Its pose.
    pub world_from_camera: Pose,
    /// Whether it is sure that the camera has not moved. Then whatever moved is tissue, and the pose is not corrected: a
    /// strong pull on the tissue would else be taken for the camera's motion in part.
    pub at_rest: bool,
}

/// A point of tissue in the left images of the last fused frame and of this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Where it was, `(x, y)` px.
    pub previous_pixel: [f32; 2],
    /// Where it is.
    pub pixel: [f32; 2],
    /// Whether the camera's motion explains it; else the tissue has deformed there.
    pub rigid: bool,
}

/// What one frame did.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport {
    /// Whether the frame was fused.
    pub fused: bool,
    /// Why not.
    pub discarded_reason: Option<DiscardReason>,
    /// Stable surfels after the frame.
    pub surfels: u32,
    /// New surfels for which the model had no room.
    pub refused: u32,
    /// What the warp's solve did, and the pose as corrected by it; `None` without a pose.
    pub warp: Option<WarpReport>,
    /// Error of the model before the frame was fused; `None` where nothing of it was in view.
    pub back_projection: Option<BackProjection>,
    /// Time of each stage.
    pub stages: Vec<StageTime>,
    /// Kernel dispatches.
    pub dispatches: u32,
}

/// Disparity and model of one session.
#[derive(Debug)]
pub struct DenseSlam {
    gpu: Arc<Gpu>,
    rig: StereoRig,
    preprocess: Preprocess,
    disparity: DisparityStage,
    surface: SurfaceStage,
    observation: Observation,
    model: SurfelModel,
}

impl DenseSlam {
    /// An empty model of what `rig` will see; compiles all kernels.
    ///
    /// # Errors
    /// [`DenseError::Config`], [`DenseError::TooManyPixels`], [`DenseError::Gpu`].
    pub fn new(
        gpu: Arc<Gpu>,
        rig: StereoRig,
        disparity: &DisparityConfig,
        dense: &DenseConfig,
    ) -> Result<Self, DenseError> {
        let size = (rig.left.width_px, rig.left.height_px);
        let observation = Observation::new(&gpu, size.0, size.1)?;
        let model = SurfelModel::new(gpu.clone(), rig, &observation, dense)?;
        let preprocess = Preprocess::new(&gpu, size, disparity)?;
        let range = DisparityRange::of_rig(&rig, disparity)?;
        let found = DisparityStage::new(&gpu, &preprocess, range, disparity)?;
        let surface = SurfaceStage::new(&gpu, &rig, &preprocess, &found, &observation, disparity)?;
        Ok(Self { gpu, rig, preprocess, disparity: found, surface, observation, model })
    }

    /// The rig that the model was made for.
    pub fn rig(&self) -> &StereoRig {
        &self.rig
    }

    /// Finds the frame's depth and, where there is a pose, fuses it.
    ///
    /// # Errors
    /// [`DenseError::ImageSize`], [`DenseError::Gpu`].
    pub fn step(&mut self, frame: &DenseFrame) -> Result<StepReport, DenseError> {
        trace_span!("upload").in_scope(|| self.upload(frame))?;
        let recording = trace_span!("record").entered();
        let mut recorder = FrameRecorder::begin(&self.gpu, self.model.timer());
        self.preprocess.record(&mut recorder)?;
        self.disparity.record(&mut recorder)?;
        self.surface.record(&mut recorder)?;
        if frame.camera.is_some() {
            self.model.record(&mut recorder)?;
        }
        let submitted = recorder.submit();
        drop(recording);
        let times = trace_span!("wait for GPU").in_scope(|| submitted.collect())?;
        let read_back = || frame.camera.map(|_| self.model.finish()).transpose();
        let fusion = trace_span!("read results").in_scope(read_back)?;
        Ok(self.report(fusion, times))
    }

    /// Everything that the frame's kernels read and the CPU knows.
    fn upload(&mut self, frame: &DenseFrame) -> Result<(), DenseError> {
        self.preprocess.upload(&self.gpu, frame.left, frame.right, frame.mask)?;
        self.surface.set_drift(&self.gpu, frame.disparity_drift_px)?;
        if let Some(camera) = &frame.camera {
            self.model.set_matches(frame.correspondences)?;
            self.model.prepare(frame.index, camera)?;
        }
        Ok(())
    }

    /// Depth of the last frame, metres, 0 where unknown.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn depth_map(&self) -> Result<DepthMap, DenseError> {
        let depth = self.gpu.read(&self.observation.depth)?;
        Ok(DepthMap::from_vec(self.observation.width, self.observation.height, depth)?)
    }

    /// Takes up material points, by id, where they are in the model's present shape (world, metres).
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn follow(&mut self, points: &[(u32, Point3<f64>)]) -> Result<(), DenseError> {
        self.model.follow(points)
    }

    /// Where the material points are now, in the order in which they were taken up.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn followed(&self) -> Result<Vec<(u32, Point3<f64>)>, DenseError> {
        self.model.followed()
    }

    /// Takes the model along with a correction of the tracker's map; as [`SurfelModel::bend`]. Poses of later frames are
    /// those of the corrected world.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn bend(&mut self, corrections: &[FrameCorrection]) -> Result<(), DenseError> {
        self.model.bend(corrections)
    }

    /// Forgets the model, for a world in which nothing is where it was. New surfels have ids from 0 on.
    ///
    /// # Errors
    /// As [`SurfelModel::new`].
    pub fn restart(&mut self) -> Result<(), DenseError> {
        self.model = SurfelModel::new(self.gpu.clone(), self.rig, &self.observation, self.model.config())?;
        Ok(())
    }

    /// The changes of the stable model since the last call, as `steps` encode them.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn take_changes(&mut self, steps: &EncodingSteps) -> Result<ChangeSet, DenseError> {
        self.model.take_changes(steps)
    }

    /// What viewers hold that were told all changes, sorted by id: the model within the publishing bounds.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn held_surfels(&self) -> Result<Vec<Surfel>, DenseError> {
        self.model.held_surfels()
    }

    /// The stable model, sorted by id.
    ///
    /// # Errors
    /// [`DenseError::Gpu`].
    pub fn surfels(&self) -> Result<Vec<Surfel>, DenseError> {
        self.model.surfels()
    }

    /// The arrays that the model lives in now, to be drawn from; other ones once it has grown.
    pub fn arrays(&self) -> ModelArrays {
        self.model.arrays()
    }

    /// A picture of the stable model and its depth.
    ///
    /// # Errors
    /// [`DenseError::TooManyPixels`], [`DenseError::Gpu`].
    pub fn render(&self, view: &View, coloring: Coloring) -> Result<Rendering, DenseError> {
        self.model.render(view, coloring, BACKGROUND)
    }

    fn report(&self, fusion: Option<FusionReport>, times: gpu::FrameTimes) -> StepReport {
        let discarded_reason = fusion.as_ref().map_or(Some(DiscardReason::NoPose), |fusion| fusion.discarded);
        StepReport {
            fused: discarded_reason.is_none(),
            discarded_reason,
            surfels: self.model.surfel_counts().1,
            refused: fusion.as_ref().map_or(0, |fusion| fusion.refused),
            warp: fusion.as_ref().map(|fusion| fusion.warp.clone()),
            back_projection: fusion.and_then(|fusion| fusion.back_projection),
            stages: times.stages,
            dispatches: times.dispatches,
        }
    }
}
