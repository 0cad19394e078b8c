//! Left to right along the rows of a rectified pair.

use geometry::StereoRig;
use rayon::prelude::*;

use super::subpixel::{self, Windows};
use crate::config::StereoConfig;
use crate::dispatch::dispatch;
use crate::feature::pyramid::to_level;
use crate::feature::{Features, Keypoint, Pyramid};

/// Where the right camera sees a left keypoint, and what that says about its depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoMatch {
    /// Column in the right image, full-size px.
    pub right_x_px: f32,
    /// Depth along the left optical axis.
    pub depth_m: f64,
    /// How much lower the right keypoint lies, full-size px: zero in a well rectified pair.
    pub row_offset_px: f32,
}

/// One eye's features and the images they came from.
#[derive(Clone, Copy)]
pub struct Eye<'a> {
    /// Keypoints and descriptors.
    pub features: &'a Features,
    /// Image pyramid.
    pub pyramid: &'a Pyramid,
}

/// Candidates within this many columns of the best one are the same place, not rivals.
const SAME_PLACE_PX: f32 = 3.0;

/// Matches each left keypoint, `None` where there is no unambiguous, plausible counterpart.
///
/// Best Hamming distance among right keypoints near the row, on the same level or one beside it, within the disparity
/// range; then sub-pixel refinement; matches with untypically different windows are dropped.
pub fn match_rows(left: Eye, right: Eye, rig: &StereoRig, config: &StereoConfig) -> Vec<Option<StereoMatch>> {
    let mut by_row: Vec<u32> = (0..right.features.len() as u32).collect();
    by_row.sort_by(|&a, &b| {
        let row = |index: u32| right.features.keypoints[index as usize].pixel.y;
        row(a).total_cmp(&row(b)).then(a.cmp(&b))
    });
    let matcher = RowMatcher { left, right, rig, config, by_row };
    let found: Vec<Option<(StereoMatch, f32)>> = (0..left.features.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|index| matcher.match_one(index))
        .collect();
    drop_dissimilar(found, config.difference_median_factor)
}

struct RowMatcher<'a> {
    left: Eye<'a>,
    right: Eye<'a>,
    rig: &'a StereoRig,
    config: &'a StereoConfig,
    /// Right keypoints from top to bottom.
    by_row: Vec<u32>,
}

impl RowMatcher<'_> {
    fn match_one(&self, index: usize) -> Option<(StereoMatch, f32)> {
        let candidate = best_candidate(self, index)?;
        let left = &self.left.features.keypoints[index];
        let right = &self.right.features.keypoints[candidate];
        let scale = self.left.pyramid.scales()[usize::from(left.level)];
        let on_level = |keypoint: &Keypoint| {
            let rounded = |coordinate: f32| to_level(coordinate, scale).round() as i32;
            (rounded(keypoint.pixel.x), rounded(keypoint.pixel.y))
        };
        let windows = Windows {
            radius: self.config.window_radius_px as usize,
            search: self.config.search_radius_px as usize,
        };
        let (left_image, right_image) =
            (self.left.pyramid.level(left.level), self.right.pyramid.level(left.level));
        let left_place = on_level(left);
        let refined = subpixel::refine(left_image, left_place, right_image, on_level(right), windows)?;
        let disparity_px = (left_place.0 as f32 - refined.x) * scale;
        let depth_m = self.rig.depth_m(f64::from(disparity_px));
        self.is_plausible(disparity_px).then(|| {
            let right_x_px = left.pixel.x - disparity_px;
            let row_offset_px = right.pixel.y - left.pixel.y;
            (StereoMatch { right_x_px, depth_m, row_offset_px }, refined.difference)
        })
    }

    /// Both bounds and NaN.
    fn is_plausible(&self, disparity_px: f32) -> bool {
        let beyond_infinity = disparity_px - self.rig.disparity_at_infinity_px() as f32;
        (self.config.disparity_min_px..=self.config.disparity_max_px).contains(&beyond_infinity)
    }
}

dispatch! {
    /// The most similar right keypoint that a left one may belong to; `None` where two are alike.
    fn best_candidate(matcher: &RowMatcher, index: usize) -> Option<usize> = best_candidate_portable;
}

#[inline(always)]
fn best_candidate_portable(matcher: &RowMatcher, index: usize) -> Option<usize> {
    let keypoint = &matcher.left.features.keypoints[index];
    let descriptor = &matcher.left.features.descriptors[index];
    let tolerance =
        matcher.config.row_tolerance_px * matcher.left.pyramid.scales()[usize::from(keypoint.level)];
    let row_of = |&candidate: &u32| matcher.right.features.keypoints[candidate as usize].pixel.y;
    let start = matcher.by_row.partition_point(|candidate| row_of(candidate) < keypoint.pixel.y - tolerance);
    let mut best = (u32::MAX, usize::MAX, 0.0);
    let mut second = u32::MAX;
    for candidate in &matcher.by_row[start..] {
        if row_of(candidate) > keypoint.pixel.y + tolerance {
            break;
        }
        let candidate = *candidate as usize;
        let other = &matcher.right.features.keypoints[candidate];
        if other.level.abs_diff(keypoint.level) > 1 || !matcher.is_plausible(keypoint.pixel.x - other.pixel.x)
        {
            continue;
        }
        let distance = descriptor.distance(&matcher.right.features.descriptors[candidate]);
        let same_place = best.1 != usize::MAX && (other.pixel.x - best.2).abs() < SAME_PLACE_PX;
        if distance < best.0 {
            second = if same_place { second } else { best.0 };
            best = (distance, candidate, other.pixel.x);
        } else if !same_place {
            second = second.min(distance);
        }
    }
    let distinct = (best.0 as f32) < matcher.config.ratio * second as f32;
    (best.0 <= matcher.config.distance_max_bits && distinct).then_some(best.1)
}

fn drop_dissimilar(found: Vec<Option<(StereoMatch, f32)>>, median_factor: f32) -> Vec<Option<StereoMatch>> {
    let mut differences: Vec<f32> = found.iter().flatten().map(|(_, difference)| *difference).collect();
    if differences.is_empty() {
        return vec![None; found.len()];
    }
    let middle = differences.len() / 2;
    let median = *differences.select_nth_unstable_by(middle, f32::total_cmp).1;
    let limit = median_factor * median.max(1.0);
    found
        .into_iter()
        .map(|entry| entry.filter(|(_, difference)| *difference <= limit).map(|(m, _)| m))
        .collect()
}
