//! How far the rows of a pair lie apart: rigs bend, and what was rectified once is not level for ever.

use geometry::{Pinhole, Rgb, StereoRig};
use tracking::feature::Extractor;
use tracking::{FrameFeatures, StereoFrame};

use crate::config::Config;

/// Matched features below which nothing is said.
const MATCHES_MIN: usize = 60;

/// How much lower the right image lies, pixels, from features matched along the rows; `None` where too few are.
pub(super) fn row_offset_px((left, right): (&Rgb, &Rgb), config: &Config) -> Option<f64> {
    if left.size() != right.size() {
        return None;
    }
    let (left, right) = (left.to_gray(), right.to_gray());
    let frame = StereoFrame { stamp_ns: 0, left: &left, right: &right, mask: None };
    let extractor = Extractor::new(&config.tracking.features);
    let features = FrameFeatures::extract(&frame, &nominal_rig(left.size()), &extractor, &config.tracking);
    features.median_row_offset_px().filter(|_| features.stereo_count() >= MATCHES_MIN)
}

/// Rows need no calibration: any rig of the images' size does.
fn nominal_rig((width_px, height_px): (u32, u32)) -> StereoRig {
    let f_px = f64::from(width_px);
    let (cx_px, cy_px) = (0.5 * f_px, 0.5 * f64::from(height_px));
    let left = Pinhole { width_px, height_px, fx_px: f_px, fy_px: f_px, cx_px, cy_px };
    StereoRig { left, baseline_m: 0.005, right_cx_px: cx_px }
}
