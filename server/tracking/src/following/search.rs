//! Features that the map does not explain, found again by their descriptors around where the camera's motion puts them.

use nalgebra::Point2;

use super::{RigidMotion, Step};
use crate::local_mapping::PosedFrame;

/// A rival this near to the best candidate is the same corner on another level.
const SAME_PLACE_PX: f32 = 3.0;

/// The most similar unclaimed feature in the window of each unclaimed earlier one; where two want the same, the more
/// similar, then the first gets it.
pub fn by_descriptor(
    last: &PosedFrame,
    now: &PosedFrame,
    motion: &RigidMotion,
    claimed: &[Step],
) -> Vec<Step> {
    let mut earlier_is_free = vec![true; last.frame.len()];
    let mut is_free = vec![true; now.frame.len()];
    for step in claimed {
        earlier_is_free[step.previous] = false;
        is_free[step.current] = false;
    }
    let mut suitors: Vec<Option<(u32, usize)>> = vec![None; now.frame.len()];
    for previous in (0..last.frame.len()).filter(|&feature| earlier_is_free[feature]) {
        let Some((distance, current)) = nearest(last, now, motion, previous, &is_free) else { continue };
        if suitors[current].is_none_or(|other| (distance, previous) < other) {
            suitors[current] = Some((distance, previous));
        }
    }
    let pairs = suitors.into_iter().enumerate();
    pairs.filter_map(|(current, suitor)| motion.step(suitor?.1, current)).collect()
}

/// Distance in bits and index; `None` where nothing is similar enough or two are alike.
fn nearest(
    last: &PosedFrame,
    now: &PosedFrame,
    motion: &RigidMotion,
    previous: usize,
    is_free: &[bool],
) -> Option<(u32, usize)> {
    let limits = motion.limits();
    let predicted = motion.predict_px(previous)?;
    let centre = Point2::new(predicted.x as f32, predicted.y as f32);
    let earlier = &last.frame.features;
    let (level, descriptor) = (earlier.keypoints[previous].level, &earlier.descriptors[previous]);
    let mut candidates = Vec::new();
    for feature in now.frame.grid.near(&centre, limits.search_radius_px) {
        let keypoint = &now.frame.features.keypoints[feature];
        let outside = (keypoint.pixel - centre).amax() > limits.search_radius_px;
        if !outside && is_free[feature] && keypoint.level.abs_diff(level) <= 1 {
            candidates.push((descriptor.distance(&now.frame.features.descriptors[feature]), feature));
        }
    }
    let best = *candidates.iter().min()?;
    let pixel = |feature: usize| now.frame.features.keypoints[feature].pixel;
    let elsewhere = |feature: usize| (pixel(feature) - pixel(best.1)).norm() > SAME_PLACE_PX;
    let rivals = candidates.iter().filter(|(_, feature)| elsewhere(*feature));
    let second = rivals.map(|(distance, _)| *distance).min().unwrap_or(u32::MAX);
    let distinct = (best.0 as f32) < limits.ratio * second as f32;
    (best.0 <= limits.distance_max_bits && distinct).then_some(best)
}
