//! Does the camera stand still while tissue moves?
//!
//! When tissue deforms, a rigid pose that follows it fits more points than the true one, and where the scene is shallow a small
//! sideways pull turns into a large rotation with a compensating translation. But a camera that moves leaves nothing in place, so
//! if a fair part of the *image* is where the last pose puts it, the camera has not moved. While it does move slowly, the best
//! pose fits many times more: the two are compared. Parts are counted by cells: a textured
//! organ on the move must not outvote a bland background.

use std::collections::BTreeMap;

use geometry::{Pose, StereoRig};

use super::reprojection::PointObservation;
use crate::config::StandstillConfig;

/// Cells with fewer matches are not judged.
const MATCHES_PER_CELL: u32 = 3;

/// Corners this many times as uncertain as the finest cannot tell a small motion from none.
const COARSEST: f64 = 1.5;

/// Share of the image cells in which at least half of the matches fit a pose tightly; 0 where no cell can be judged.
pub fn still_share(
    rig: &StereoRig,
    camera_from_world: &Pose,
    points: &[PointObservation],
    config: &StandstillConfig,
) -> f64 {
    let finest_px = points.iter().map(|point| point.observation.sigma_px).fold(f64::INFINITY, f64::min);
    let mut cells: BTreeMap<(i64, i64), (u32, u32)> = BTreeMap::new();
    for point in points.iter().filter(|point| point.observation.sigma_px <= COARSEST * finest_px) {
        let cell = point.observation.pixel / config.cell_px;
        let misfit = point.observation.misfit(rig, &(camera_from_world * point.point_in_world));
        let (matches, still) = cells.entry((cell.x as i64, cell.y as i64)).or_default();
        *matches += 1;
        *still += u32::from(misfit <= config.misfit_max);
    }
    let judged = cells.values().filter(|(matches, _)| *matches >= MATCHES_PER_CELL);
    let (judged, still) = judged.fold((0, 0), |(judged, quiet), (matches, still)| {
        (judged + 1, quiet + u32::from(2 * still >= *matches))
    });
    if judged == 0 { 0.0 } else { f64::from(still) / f64::from(judged) }
}
