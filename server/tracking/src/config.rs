//! Section `[tracking]` of the configuration. Values and their meaning for users: `config/server.toml`.

use serde::Deserialize;

use crate::TrackingError;

/// Everything that can be set about the tracker.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackingConfig {
    /// How much of it is done.
    pub mode: TrackingMode,
    /// Detection.
    pub features: FeatureConfig,
    /// Where not to detect.
    pub masks: MaskConfig,
    /// Left to right.
    pub stereo: StereoConfig,
    /// Map to image.
    pub search: SearchConfig,
    /// Pose from matches.
    pub pose: PoseConfig,
    /// When the camera is taken not to move.
    pub standstill: StandstillConfig,
    /// When a frame counts as tracked and what to try when it does not.
    pub recovery: RecoveryConfig,
    /// Keyframes and points.
    pub map: MapConfig,
    /// Frame to frame.
    pub following: FollowingConfig,
    /// Adjustment of both beside tracking.
    pub mapping: MappingConfig,
    /// Places by their looks.
    pub recognition: RecognitionConfig,
    /// Coming back to a place.
    pub loops: LoopConfig,
}

/// How poses are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrackingMode {
    /// With a map, relocalisation and all.
    Slam,
    /// From frame to frame, without a map.
    Odometry,
    /// Not at all: the camera is taken not to move.
    None,
}

/// Detection of oriented FAST corners.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureConfig {
    /// Features per image.
    pub count: u32,
    /// Pyramid levels.
    pub levels: u32,
    /// Size ratio of neighbouring levels.
    pub scale_factor: f32,
    /// FAST threshold, grey levels.
    pub high_threshold: u8,
    /// FAST threshold in cells where the high one finds nothing, grey levels.
    pub low_threshold: u8,
    /// Side of such a cell, pixels of its level.
    pub cell_px: u32,
}

/// Pixels that carry no trustworthy corner.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskConfig {
    /// Grey level from which a pixel is a highlight.
    pub specular_level: u8,
    /// Grey level up to which the image's rim is the black frame of the useful area.
    pub black_level: u8,
    /// Distance of a keypoint from masked pixels, pixels of its level.
    pub margin_px: f32,
}

/// Matching along rows.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StereoConfig {
    /// Row difference allowed on the finest level, px; grows with the level's scale.
    pub row_tolerance_px: f32,
    /// Smallest disparity beyond that of infinity, px.
    pub disparity_min_px: f32,
    /// Largest disparity beyond that of infinity, px.
    pub disparity_max_px: f32,
    /// Most differing descriptor bits.
    pub distance_max_bits: u32,
    /// Best over second best distance must stay below this.
    pub ratio: f32,
    /// Half side of the compared windows, px of the keypoint's level.
    pub window_radius_px: u32,
    /// Search to both sides of the matched keypoint, px of the level.
    pub search_radius_px: u32,
    /// Matches whose window difference exceeds this multiple of the median are dropped.
    pub difference_median_factor: f32,
    /// Time in which a drift of the rig's disparity is followed, s.
    pub drift_time_s: f64,
    /// Smallest drift that is believed, px.
    pub drift_min_px: f64,
    /// Largest drift that is believed, px; 0 turns it off.
    pub drift_max_px: f64,
}

/// Projection search.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchConfig {
    /// Window half side around points predicted by the motion model, px; grows with the level's scale.
    pub motion_radius_px: f32,
    /// The wider window tried when that finds too little, px.
    pub wide_radius_px: f32,
    /// Window half side around local map points once a pose is known, px.
    pub map_radius_px: f32,
    /// Most differing descriptor bits.
    pub distance_max_bits: u32,
    /// Best over second best distance in a window must stay below this.
    pub ratio: f32,
    /// The same for matches between whole images.
    pub brute_force_ratio: f32,
    /// Largest angle between the line of sight and those a point was seen along, degrees.
    pub view_angle_max_deg: f64,
}

/// Robust pose-only optimisation.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseConfig {
    /// Standard deviation of a keypoint on the finest level, px; grows with the level's scale.
    pub sigma_px: f64,
    /// Rounds of optimisation, each followed by outlier classification.
    pub rounds: u32,
    /// Levenberg-Marquardt steps per round.
    pub steps: u32,
}

/// Detection of a camera at rest before moving tissue.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandstillConfig {
    /// Side of the image cells that vote.
    pub cell_px: f64,
    /// Squared whitened residual per degree of freedom up to which a match is where the last pose puts it.
    pub misfit_max: f64,
    /// Share of cells that must be at rest.
    pub share_min: f64,
    /// The same relative to the cells that fit the best moving pose as tightly.
    pub share_of_best_min: f64,
}

/// Acceptance of poses, and the way back.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecoveryConfig {
    /// Stereo points needed to start a map.
    pub initial_points_min: u32,
    /// Inliers needed for a first estimate of a pose.
    pub first_inliers_min: u32,
    /// Inliers needed after the local map search for a frame to count as tracked.
    pub inliers_min: u32,
    /// The same to be found again after being lost.
    pub recovery_inliers_min: u32,
    /// Share of the matches that must be inliers then: wrong poses find matches too, but few that agree.
    pub inlier_share_min: f64,
    /// RANSAC samples at most.
    pub ransac_samples_max: u32,
    /// RANSAC stops when a better sample is less likely than one minus this.
    pub ransac_confidence: f64,
    /// Factor on the uncertainty of features in matches between whole images.
    pub sigma_factor: f64,
    /// A map of at most this many keyframes is forgotten when the camera stays lost, ...
    pub restart_keyframes_max: u32,
    /// ... for this many usable frames.
    pub restart_frames: u32,
}

/// Keyframes and map points.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapConfig {
    /// Stereo points are mapped up to this multiple of the baseline.
    pub depth_max_baselines: f64,
    /// A keyframe is inserted when a frame tracks less than this share of its reference keyframe's points.
    pub tracked_share_min: f64,
    /// ... or has moved by this share of the median depth since the last keyframe.
    pub motion_max_depth_share: f64,
    /// ... or has turned by this angle, degrees.
    pub rotation_max_deg: f64,
    /// Frames between keyframes at least.
    pub frames_between_min: u32,
    /// Keyframes whose points are searched for in a frame.
    pub local_keyframes: u32,
    /// Latest observations that a point's position is refined from.
    pub refine_observations: u32,
    /// Points found in less than this share of the frames that should show them are removed.
    pub found_share_min: f64,
    /// Keyframes within which a point must be seen again.
    pub probation_keyframes: u32,
    /// Keyframes kept at most.
    pub keyframes_max: u32,
    /// Map points kept at most.
    pub points_max: u32,
}

/// Following of features on moving tissue.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FollowingConfig {
    /// Window half side around where the camera's motion alone puts a feature, px.
    pub search_radius_px: f32,
    /// Most differing descriptor bits.
    pub distance_max_bits: u32,
    /// Best over second best distance in a window must stay below this.
    pub ratio: f32,
    /// Radius within which features are neighbours, px.
    pub neighbour_radius_px: f32,
    /// Neighbours that must move alike.
    pub neighbours_min: u32,
    /// Share of the neighbours that must move alike.
    pub share_min: f32,
    /// Difference of motion up to which neighbours move alike, px.
    pub agreement_px: f32,
    /// ... and additionally this times their distance.
    pub strain_max: f32,
    /// Mean motion of a neighbourhood, beyond the camera's, up to which its features are rigid, px.
    pub still_px: f32,
}

/// What is done about a keyframe beside tracking.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappingConfig {
    /// Frames after which the results are taken in a replay.
    pub delay_frames: u32,
    /// Keyframes adjusted at once.
    pub window_keyframes: u32,
    /// Further keyframes that hold them in place.
    pub fixed_keyframes: u32,
    /// Descents of bundle adjustment, outliers told apart before each.
    pub adjustment_rounds: u32,
    /// Levenberg-Marquardt steps of each.
    pub adjustment_steps: u32,
    /// Neighbours searched for a new keyframe's points, and for matches with its features that have no depth.
    pub neighbours: u32,
    /// Window half side in which a neighbour's feature is taken for a point, px; grows with the level's scale.
    pub fusion_radius_px: f32,
    /// Most differing descriptor bits of features from which a point is triangulated.
    pub triangulation_bits_max: u32,
    /// Least angle between their lines of sight, degrees.
    pub parallax_min_deg: f64,
    /// A keyframe of whose points at least this share is seen by three others is removed.
    pub redundant_share: f64,
}

/// Recognition of places.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecognitionConfig {
    /// Most differing bits of descriptors that are taken for the same corner.
    pub distance_max_bits: u32,
    /// Similar keyframes that a lost frame is compared with.
    pub candidates: u32,
}

/// Loop closing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopConfig {
    /// Keyframes since the place was last seen.
    pub keyframes_between_min: u32,
    /// Share of a keyframe's descriptors of which an old one and its neighbours must have the most similar to be looked at closely.
    pub share_min: f64,
    /// Old points that must fit the new keyframe's pose.
    pub inliers_min: u32,
    /// Shared points from which two keyframes hold each other in the correction.
    pub essential_points_min: u32,
}

/// Refuses a value unless `condition` holds.
fn check(
    key: &'static str,
    value: f64,
    condition: bool,
    requirement: &'static str,
) -> Result<(), TrackingError> {
    if condition { Ok(()) } else { Err(TrackingError::Config { key, value, requirement }) }
}

impl TrackingConfig {
    /// Checks what would otherwise fail or allocate without bound later.
    ///
    /// # Errors
    /// [`TrackingError::Config`] names the key, its value and what it must be.
    pub fn validate(&self) -> Result<(), TrackingError> {
        self.features.validate()?;
        self.stereo.validate()?;
        self.search.validate()?;
        self.pose.validate()?;
        self.standstill.validate()?;
        self.recovery.validate()?;
        self.map.validate()?;
        self.following.validate()?;
        self.mapping.validate()
    }
}

impl FeatureConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        let Self { count, levels, scale_factor, high_threshold, low_threshold, cell_px } = self;
        check("features.count", f64::from(*count), (50..=20_000).contains(count), "50 to 20000")?;
        check("features.levels", f64::from(*levels), (1..=16).contains(levels), "1 to 16")?;
        let factor_fits = (1.05..=2.0).contains(scale_factor);
        check("features.scale_factor", f64::from(*scale_factor), factor_fits, "1.05 to 2")?;
        check(
            "features.low_threshold",
            f64::from(*low_threshold),
            low_threshold <= high_threshold,
            "at most high_threshold",
        )?;
        check("features.cell_px", f64::from(*cell_px), *cell_px >= 8, "8 or more")
    }
}

impl StereoConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        let (low, high) = (self.disparity_min_px, self.disparity_max_px);
        check("stereo.disparity_min_px", f64::from(low), low > 0.0, "positive")?;
        check("stereo.disparity_max_px", f64::from(high), high > low, "above disparity_min_px")?;
        let tolerance = self.row_tolerance_px;
        check("stereo.row_tolerance_px", f64::from(tolerance), (0.5..=8.0).contains(&tolerance), "0.5 to 8")?;
        let radius = self.window_radius_px;
        check("stereo.window_radius_px", f64::from(radius), (2..=7).contains(&radius), "2 to 7")?;
        let radius = self.search_radius_px;
        check("stereo.search_radius_px", f64::from(radius), (1..=8).contains(&radius), "1 to 8")?;
        check("stereo.drift_time_s", self.drift_time_s, self.drift_time_s > 0.0, "positive")?;
        check("stereo.drift_min_px", self.drift_min_px, self.drift_min_px >= 0.0, "zero or more")?;
        check("stereo.drift_max_px", self.drift_max_px, (0.0..=8.0).contains(&self.drift_max_px), "0 to 8")
    }
}

impl SearchConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        for (key, radius) in [
            ("search.motion_radius_px", self.motion_radius_px),
            ("search.wide_radius_px", self.wide_radius_px),
            ("search.map_radius_px", self.map_radius_px),
        ] {
            check(key, f64::from(radius), radius > 0.0 && radius.is_finite(), "positive")?;
        }
        Ok(())
    }
}

impl PoseConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        check("pose.sigma_px", self.sigma_px, self.sigma_px > 0.0 && self.sigma_px.is_finite(), "positive")?;
        check("pose.rounds", f64::from(self.rounds), (1..=20).contains(&self.rounds), "1 to 20")?;
        check("pose.steps", f64::from(self.steps), (1..=100).contains(&self.steps), "1 to 100")
    }
}

impl StandstillConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        check("standstill.cell_px", self.cell_px, self.cell_px >= 8.0, "8 or more")?;
        check("standstill.misfit_max", self.misfit_max, self.misfit_max > 0.0, "positive")?;
        check(
            "standstill.share_min",
            self.share_min,
            self.share_min > 0.0,
            "positive; above 1 turns it off",
        )?;
        let of_best = self.share_of_best_min;
        check("standstill.share_of_best_min", of_best, of_best >= 0.0, "zero or more")
    }
}

impl RecoveryConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        for (key, count) in [
            ("recovery.initial_points_min", self.initial_points_min),
            ("recovery.first_inliers_min", self.first_inliers_min),
            ("recovery.inliers_min", self.inliers_min),
            ("recovery.recovery_inliers_min", self.recovery_inliers_min),
        ] {
            check(key, f64::from(count), count >= 6, "6 or more")?;
        }
        let samples = self.ransac_samples_max;
        check(
            "recovery.ransac_samples_max",
            f64::from(samples),
            (1..=100_000).contains(&samples),
            "1 to 100000",
        )?;
        let confidence = self.ransac_confidence;
        check(
            "recovery.ransac_confidence",
            confidence,
            confidence > 0.0 && confidence < 1.0,
            "between 0 and 1",
        )
    }
}

impl FollowingConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        for (key, radius) in [
            ("following.search_radius_px", self.search_radius_px),
            ("following.neighbour_radius_px", self.neighbour_radius_px),
        ] {
            check(key, f64::from(radius), (1.0..=500.0).contains(&radius), "1 to 500")?;
        }
        for (key, value) in [
            ("following.agreement_px", self.agreement_px),
            ("following.strain_max", self.strain_max),
            ("following.still_px", self.still_px),
            ("following.share_min", self.share_min),
        ] {
            check(key, f64::from(value), value >= 0.0, "zero or more")?;
        }
        Ok(())
    }
}

impl MapConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        let reach = self.depth_max_baselines;
        check("map.depth_max_baselines", reach, reach > 1.0, "above 1")?;
        check(
            "map.local_keyframes",
            f64::from(self.local_keyframes),
            self.local_keyframes >= 1,
            "1 or more",
        )?;
        let observations = self.refine_observations;
        check(
            "map.refine_observations",
            f64::from(observations),
            (1..=100).contains(&observations),
            "1 to 100",
        )?;
        check("map.keyframes_max", f64::from(self.keyframes_max), self.keyframes_max >= 10, "10 or more")?;
        check("map.points_max", f64::from(self.points_max), self.points_max >= 1000, "1000 or more")
    }
}

impl MappingConfig {
    fn validate(&self) -> Result<(), TrackingError> {
        let delay = self.delay_frames;
        check("mapping.delay_frames", f64::from(delay), (1..=30).contains(&delay), "1 to 30")?;
        for (key, count) in [
            ("mapping.window_keyframes", self.window_keyframes),
            ("mapping.fixed_keyframes", self.fixed_keyframes),
            ("mapping.adjustment_rounds", self.adjustment_rounds),
            ("mapping.adjustment_steps", self.adjustment_steps),
        ] {
            check(key, f64::from(count), (1..=50).contains(&count), "1 to 50")?;
        }
        let radius = self.fusion_radius_px;
        check("mapping.fusion_radius_px", f64::from(radius), radius > 0.0 && radius.is_finite(), "positive")?;
        let parallax = self.parallax_min_deg;
        check("mapping.parallax_min_deg", parallax, parallax > 0.0 && parallax < 90.0, "between 0 and 90")?;
        check(
            "mapping.redundant_share",
            self.redundant_share,
            self.redundant_share > 0.0,
            "positive; above 1 turns it off",
        )
    }
}
