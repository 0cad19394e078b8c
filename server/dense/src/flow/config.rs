//! `[dense.flow]`.

use serde::Deserialize;

use crate::DenseError;
use crate::config::{all_positive, require};

/// The largest patch: its sums stay well within single precision.
const RADIUS_LIMIT: u32 = 15;
/// The most patches that a configuration may ask for.
const PATCHES_LIMIT: u32 = 16_384;

/// Options of the patches of tissue that are followed from picture to picture.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowConfig {
    /// The most patches: they lie on a grid that has no more; 0 follows none.
    pub patches_max: u32,
    /// Frames after which patches are taken from a new picture.
    pub keyframe_frames: u32,
    /// Half width of a patch, samples.
    pub radius: u32,
    /// Gauss-Newton steps at each of the three sample distances.
    pub steps: u32,
    /// Largest standard deviation of a match.
    pub spread_max_px: f64,
    /// Largest way from where depth and camera put the patch.
    pub reach_px: f64,
    /// Largest root mean square of what is left, grey levels.
    pub misfit_max: f64,
}

impl FlowConfig {
    /// Checks what the kernel relies on.
    pub(crate) fn check(&self) -> Result<(), DenseError> {
        let positive = [
            ("dense.flow.spread_max_px", self.spread_max_px),
            ("dense.flow.reach_px", self.reach_px),
            ("dense.flow.misfit_max", self.misfit_max),
            ("dense.flow.steps", f64::from(self.steps)),
            ("dense.flow.keyframe_frames", f64::from(self.keyframe_frames)),
        ];
        all_positive(&positive)?;
        let radius = self.radius;
        require(
            (2..=RADIUS_LIMIT).contains(&radius),
            "dense.flow.radius",
            f64::from(radius),
            "from 2 to 15",
        )?;
        let patches = self.patches_max;
        require(patches <= PATCHES_LIMIT, "dense.flow.patches_max", f64::from(patches), "at most 16384")
    }

    /// Pixels from patch to patch in an image of `size`, and the patches in columns and rows; no patches where none are
    /// wanted.
    pub(crate) fn grid(&self, (width, height): (u32, u32)) -> (u32, [u32; 2]) {
        let cells = |spacing: u32| [width / spacing, height / spacing];
        let fits = |spacing: &u32| {
            let [columns, rows] = cells(*spacing);
            u64::from(columns) * u64::from(rows) <= u64::from(self.patches_max)
        };
        let spacing = (2..=width.max(height).max(2)).find(fits).unwrap_or(width.max(height) + 1);
        (spacing, if self.patches_max == 0 { [0, 0] } else { cells(spacing) })
    }
}
