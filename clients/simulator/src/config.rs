//! What a run looks like: section `[simulate]` of `config/server.toml`, where the defaults live.

use std::fmt;
use std::str::FromStr;

use geometry::{Pinhole, StereoRig};
use serde::{Deserialize, Serialize};

use crate::SimulatorError;

const FOCAL_PX_AT_REFERENCE_WIDTH: f64 = 520.0;
const REFERENCE_WIDTH_PX: f64 = 640.0;

/// The organ in front of the scope.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SceneKind {
    /// Beating muscle with fat and coronary vessels in its grooves.
    Heart,
    /// A large smooth dome with a fissure, a sharp edge and the gall bladder below it.
    Liver,
    /// A bean in a bed of fat.
    Kidney,
    /// A silicone heart on cloth that deforms periodically.
    Phantom,
    /// Bowel loops, stomach, liver edge and fat before the abdominal wall.
    Abdomen,
}

impl SceneKind {
    /// All scenes.
    pub const ALL: [Self; 5] = [Self::Heart, Self::Liver, Self::Kidney, Self::Phantom, Self::Abdomen];

    fn name(self) -> &'static str {
        match self {
            Self::Heart => "heart",
            Self::Liver => "liver",
            Self::Kidney => "kidney",
            Self::Phantom => "phantom",
            Self::Abdomen => "abdomen",
        }
    }
}

impl fmt::Display for SceneKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for SceneKind {
    type Err = SimulatorError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let known = Self::ALL.into_iter().find(|kind| kind.name() == name);
        known.ok_or_else(|| SimulatorError::UnknownScene { name: name.to_owned() })
    }
}

/// One run of the simulator. The same values give the same bits, whatever the number of threads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneConfig {
    /// The organ.
    pub scene: SceneKind,
    /// Frames of the run.
    pub frames: u32,
    /// Frames a second.
    pub fps: f64,
    /// Columns of each picture; the focal length scales with it (520 px at 640).
    pub width_px: u32,
    /// Rows of each picture.
    pub height_px: u32,
    /// Distance of the two eyes.
    pub baseline_mm: f64,
    /// Chooses shapes, textures, vessels, motion, pushes and noise.
    pub seed: u64,
    /// Greatest displacement of one push (each is 2/3 to 1 of it), or of the phantom's beat; 0: no pushes, no beat.
    pub deformation_mm: f64,
    /// Peak displacement by breathing; 0: none. The phantom does not breathe.
    pub respiration_mm: f64,
    /// Breaths a second.
    pub respiration_hz: f64,
    /// Beats a second of the phantom.
    pub beat_hz: f64,
    /// Time between the starts of two pushes.
    pub push_interval_s: f64,
    /// Time that one push takes; the tissue then stays.
    pub push_duration_s: f64,
    /// Least radius of a push.
    pub push_radius_min_mm: f64,
    /// Greatest radius of a push.
    pub push_radius_max_mm: f64,
    /// Length of the scope's closed path; shorter where the run is too short for it.
    pub path_mm: f64,
    /// Greatest speed on that path.
    pub speed_max_mm_s: f64,
    /// Size of one sudden movement to the side and back; 0: none.
    pub jerk_mm: f64,
    /// Frame at which the sudden movement starts.
    pub jerk_frame: u32,
    /// Time that the shutter is open; it blurs what moves.
    pub exposure_ms: f64,
    /// Fall of brightness at the picture's corners, 0 to 1.
    pub vignette: f64,
    /// Whether wet tissue mirrors the light.
    pub highlights: bool,
    /// Whether the sensor adds shot and read noise.
    pub noise: bool,
    /// Electrons of a white pixel: fewer make more shot noise.
    pub full_well_electrons: f64,
    /// Standard deviation of the read noise.
    pub read_noise_electrons: f64,
    /// Material points followed through the run.
    pub points: u32,
}

impl SceneConfig {
    /// Seconds since the first frame.
    pub fn time_s(&self, frame: u32) -> f64 {
        f64::from(frame) / self.fps
    }

    /// The rectified rig that the pictures are taken with.
    pub fn rig(&self) -> StereoRig {
        let focal_px = FOCAL_PX_AT_REFERENCE_WIDTH * f64::from(self.width_px) / REFERENCE_WIDTH_PX;
        let cx_px = 0.5 * (f64::from(self.width_px) - 1.0);
        let cy_px = 0.5 * (f64::from(self.height_px) - 1.0);
        let (width_px, height_px) = (self.width_px, self.height_px);
        let left = Pinhole { width_px, height_px, fx_px: focal_px, fy_px: focal_px, cx_px, cy_px };
        StereoRig { left, baseline_m: self.baseline_mm * 1e-3, right_cx_px: cx_px }
    }

    /// Refuses what cannot be simulated, before anything is allocated for it.
    ///
    /// # Errors
    /// [`SimulatorError::OutOfRange`] names the key, the value and the range.
    pub fn check(&self) -> Result<(), SimulatorError> {
        let ranges = [
            ("frames", f64::from(self.frames), 1.0, 100_000.0),
            ("fps", self.fps, 1.0, 240.0),
            ("width_px", f64::from(self.width_px), 64.0, 4096.0),
            ("height_px", f64::from(self.height_px), 48.0, 4096.0),
            ("baseline_mm", self.baseline_mm, 1.0, 20.0),
            ("deformation_mm", self.deformation_mm, 0.0, 20.0),
            ("respiration_mm", self.respiration_mm, 0.0, 20.0),
            ("respiration_hz", self.respiration_hz, 0.0, 5.0),
            ("beat_hz", self.beat_hz, 0.0, 5.0),
            ("push_interval_s", self.push_interval_s, 0.05, 1e6),
            ("push_duration_s", self.push_duration_s, 0.05, 60.0),
            ("push_radius_min_mm", self.push_radius_min_mm, 5.0, 80.0),
            ("push_radius_max_mm", self.push_radius_max_mm, self.push_radius_min_mm, 80.0),
            ("path_mm", self.path_mm, 0.0, 400.0),
            ("speed_max_mm_s", self.speed_max_mm_s, 0.0, 300.0),
            ("jerk_mm", self.jerk_mm, 0.0, 40.0),
            ("exposure_ms", self.exposure_ms, 0.0, 1000.0 / self.fps),
            ("vignette", self.vignette, 0.0, 1.0),
            ("full_well_electrons", self.full_well_electrons, 100.0, 1e6),
            ("read_noise_electrons", self.read_noise_electrons, 0.0, 1e3),
            ("points", f64::from(self.points), 1.0, 100_000.0),
        ];
        let bad = ranges.into_iter().find(|(_, value, min, max)| !(min..=max).contains(&value));
        match bad {
            Some((key, value, min, max)) => Err(SimulatorError::OutOfRange { key, value, min, max }),
            None => Ok(()),
        }
    }
}
