//! What comes out of a frame.

use geometry::Pose;
use nalgebra::Point2;

/// What the tracker knows after a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// No frame yet had enough stereo points to start a map.
    NotInitialized,
    /// The pose follows from the last one.
    Tracked,
    /// Found again after being lost.
    Recovered,
    /// The pose is unknown.
    Lost {
        /// Stamp of the first frame that could not be tracked.
        since_ns: u64,
    },
}

/// A left feature of the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedFeature {
    /// Where, full-size px.
    pub pixel: Point2<f32>,
    /// Depth by stereo, where the right image shows it too.
    pub depth_m: Option<f64>,
    /// Whether it is an inlier match of a map point.
    pub matched: bool,
    /// Number that the feature keeps from frame to frame; `None` in frames without a pose.
    pub track: Option<TrackId>,
    /// From where it came; `None` where its track starts.
    pub motion: Option<FeatureMotion>,
}

/// Names a feature that is followed through the tracked frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TrackId(pub u64);

/// How a feature moved since the last tracked frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureMotion {
    /// Where it was, full-size px.
    pub previous_pixel: Point2<f32>,
    /// Disparity there, px, where the right image showed it too.
    pub previous_disparity_px: Option<f32>,
    /// Disparity now, px.
    pub disparity_px: Option<f32>,
    /// Whether the camera's motion explains it; else the tissue deforms there, as its neighbours confirm.
    pub rigid: bool,
    /// Information relative to a feature of the finest level that all neighbours agree with.
    pub weight: f32,
}

/// How the pose was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseSource {
    /// The first frame defines the world.
    FirstFrame,
    /// The camera has not moved since the last frame, whatever the tissue did.
    Standstill,
    /// Projection search around the motion model's prediction.
    MotionModel,
    /// The same with the wide window.
    WideSearch,
    /// Descriptor matches with the last frame.
    LastFrame,
    /// Descriptor matches with the reference keyframe.
    ReferenceKeyframe,
    /// Descriptor matches with another keyframe.
    Relocalisation,
}

/// Why a frame became a keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyframeReason {
    /// It started the map.
    First,
    /// It tracked too small a share of the reference keyframe's points.
    FewTracked,
    /// The camera had moved far for the scene's depth.
    Motion,
    /// The camera had turned.
    Rotation,
    /// The camera was found again.
    Recovery,
    /// Odometry knows no frame but the last.
    Odometry,
}

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrackingStatistics {
    /// Features in the left image.
    pub left_features: usize,
    /// Features in the right image.
    pub right_features: usize,
    /// Left features with a depth.
    pub stereo_points: usize,
    /// Local map points that were searched for.
    pub searched_points: usize,
    /// Map points found.
    pub matches: usize,
    /// Map points found that fit the pose.
    pub inliers: usize,
    /// Keyframes in the map.
    pub keyframes: usize,
    /// Points in the map.
    pub map_points: usize,
    /// Keyframes so far that mapping did not look into, because newer ones came while it was busy.
    pub keyframes_passed_over: u64,
}

/// Everything about one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingReport {
    /// What is known.
    pub outcome: Outcome,
    /// The camera in the world of the first tracked left camera; `None` unless tracked or recovered.
    pub world_from_camera: Option<Pose>,
    /// How the pose was found; `None` where there is none, or tracking is off.
    pub source: Option<PoseSource>,
    /// Left features.
    pub features: Vec<TrackedFeature>,
    /// Counts.
    pub statistics: TrackingStatistics,
    /// Set where the frame became a keyframe.
    pub keyframe: Option<KeyframeReason>,
    /// How the rig has drifted from its calibration.
    pub drift: StereoDrift,
    /// Set where the map, or what is known of the camera, has changed by more than a frame's motion.
    pub correction: Option<MapCorrection>,
}

/// A correction of the map, for what hangs on it: the dense model bends with the keyframes.
#[derive(Clone, Debug, PartialEq)]
pub struct MapCorrection {
    /// What happened.
    pub kind: CorrectionKind,
    /// Where the keyframes were and are, oldest first.
    pub keyframes: Vec<KeyframeCorrection>,
}

/// Why the map changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CorrectionKind {
    /// The camera came back to an old place: all keyframes, with the drift since then taken out.
    Loop,
    /// The camera was found again. The map stands as it was; the one entry is the camera, from where it was lost.
    Relocalization,
    /// The map was useless and was forgotten: this frame defines a new world. No keyframes.
    Restart,
}

/// Where a keyframe was and is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeyframeCorrection {
    /// When it was taken.
    pub stamp_ns: u64,
    /// Its pose before.
    pub world_from_camera_before: Pose,
    /// Its pose now.
    pub world_from_camera_after: Pose,
}

/// How far two optical paths have bent against each other since they were calibrated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StereoDrift {
    /// What all disparities have too much, px.
    pub disparity_px: f64,
    /// How much lower the right image lies, px.
    pub row_px: f64,
}
