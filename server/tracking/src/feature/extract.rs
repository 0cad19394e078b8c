//! From an image to oriented, described corners on all pyramid levels.

use geometry::{Gray, Raster};
use nalgebra::Point2;
use rayon::prelude::*;

use super::fast::{self, Corner};
use super::pyramid::{Pyramid, level_size, to_full_size};
use super::{BORDER_PX, Descriptor, Keypoint, ValidityMap, brief, distribution, orientation, smooth};
use crate::config::FeatureConfig;

/// Keypoints and their descriptors, index by index, coarse levels last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// Where and how oriented.
    pub keypoints: Vec<Keypoint>,
    /// What the patch looks like.
    pub descriptors: Vec<Descriptor>,
}

impl Features {
    /// Number of features.
    pub fn len(&self) -> usize {
        self.keypoints.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.keypoints.is_empty()
    }
}

/// Finds features by one configuration.
#[derive(Clone, Debug)]
pub struct Extractor {
    config: FeatureConfig,
    /// Features wanted on each level.
    quotas: Vec<usize>,
}

impl Extractor {
    /// Spreads `config.count` over the levels in proportion to their side lengths.
    pub fn new(config: &FeatureConfig) -> Self {
        let shares: Vec<f32> =
            (0..config.levels).map(|level| config.scale_factor.powi(-(level as i32))).collect();
        let total: f32 = shares.iter().sum();
        let quotas =
            shares.iter().map(|share| (config.count as f32 * share / total).round() as usize).collect();
        Self { config: config.clone(), quotas }
    }

    /// Full-size pixels per pixel of each level.
    pub fn scales(&self) -> Vec<f32> {
        (0..self.config.levels).map(|level| self.config.scale_factor.powi(level as i32)).collect()
    }

    /// Features of an image where `validity` allows them, and the pyramid they were found on.
    pub fn extract(&self, image: &Gray, validity: &ValidityMap) -> (Features, Pyramid) {
        let pyramid = Pyramid::build(image, self.config.levels, self.config.scale_factor);
        let by_level: Vec<Features> = (0..pyramid.levels().len())
            .into_par_iter()
            .map(|level| self.extract_level(&pyramid, level, validity))
            .collect();
        let mut features = Features::default();
        for level in by_level {
            features.keypoints.extend(level.keypoints);
            features.descriptors.extend(level.descriptors);
        }
        (features, pyramid)
    }

    fn extract_level(&self, pyramid: &Pyramid, level: usize, validity: &ValidityMap) -> Features {
        let (image, scale) = (&pyramid.levels()[level], pyramid.scales()[level]);
        let scores = fast::score_map(image, self.config.low_threshold);
        let mut corners = fast::local_maxima(&scores, BORDER_PX);
        let limit = |length: u32| (length - 1) as f32;
        let (limit_x, limit_y) = (limit(pyramid.level(0).width()), limit(pyramid.level(0).height()));
        corners.retain(|corner| {
            let (x, y) = (to_full_size(corner.x as f32, scale), to_full_size(corner.y as f32, scale));
            validity.allows(x.clamp(0.0, limit_x), y.clamp(0.0, limit_y), scale)
        });
        let corners = prefer_strong(corners, image.size(), &self.config);
        let corners = distribution::distribute(corners, image.size(), self.quotas[level]);
        describe_level(image, &scores, &corners, level as u8, scale)
    }
}

/// Keeps weak corners only in cells that have no strong one.
fn prefer_strong(
    mut corners: Vec<Corner>,
    (width, height): (u32, u32),
    config: &FeatureConfig,
) -> Vec<Corner> {
    let columns = width.div_ceil(config.cell_px);
    let cell = |corner: &Corner| (corner.y / config.cell_px * columns + corner.x / config.cell_px) as usize;
    let mut has_strong = vec![false; (columns * height.div_ceil(config.cell_px)) as usize];
    for corner in corners.iter().filter(|corner| corner.score > config.high_threshold) {
        has_strong[cell(corner)] = true;
    }
    corners.retain(|corner| corner.score > config.high_threshold || !has_strong[cell(corner)]);
    corners
}

fn describe_level(image: &Gray, scores: &Raster<u8>, corners: &[Corner], level: u8, scale: f32) -> Features {
    let smoothed = if corners.is_empty() { Raster::filled(0, 0, 0) } else { smooth::gaussian_7x7(image) };
    let mut features = Features::default();
    for corner in corners {
        let angle_rad = orientation::angle_rad(image, corner.x, corner.y);
        let (dx, dy) = peak_offset(scores, corner);
        let pixel =
            Point2::new(to_full_size(corner.x as f32 + dx, scale), to_full_size(corner.y as f32 + dy, scale));
        features.keypoints.push(Keypoint { pixel, level, angle_rad, score: corner.score });
        features.descriptors.push(brief::describe(&smoothed, corner.x, corner.y, angle_rad));
    }
    features
}

/// Sub-pixel peak of the score by a parabola along x and along y, within half a pixel.
fn peak_offset(scores: &Raster<u8>, corner: &Corner) -> (f32, f32) {
    let peak = f32::from(corner.score);
    let offset = |before: u8, after: u8| {
        let (before, after) = (f32::from(before), f32::from(after));
        let curvature = before + after - 2.0 * peak;
        if curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
    };
    let (x, y) = (corner.x, corner.y);
    (offset(scores[(x - 1, y)], scores[(x + 1, y)]), offset(scores[(x, y - 1)], scores[(x, y + 1)]))
}

/// Whether every level of an image of this size has room for at least one keypoint.
pub fn has_room_for_features(size: (u32, u32), config: &FeatureConfig) -> bool {
    let (width, height) = level_size(size, config.scale_factor.powi(config.levels as i32 - 1));
    width.min(height) > 2 * BORDER_PX
}
