//! Map points to image features: each point is projected with a pose and compared with the features in a window.

use geometry::{Pose, StereoRig};
use nalgebra::{Point2, Point3};

use crate::config::SearchConfig;
use crate::dispatch::dispatch;
use crate::feature::Descriptor;
use crate::frame::FrameFeatures;
use crate::map::{Map, PointId};
use crate::solve::reprojection;

/// What a search needs to know beside points and features.
#[derive(Clone, Copy)]
pub struct ProjectionSearch<'a> {
    /// The cameras.
    pub rig: &'a StereoRig,
    /// Limits on descriptors and angles.
    pub config: &'a SearchConfig,
    /// Full-size pixels per pixel of each level.
    pub scales: &'a [f32],
    /// Window half side on the finest level, px; grows with the level's scale.
    pub radius_px: f32,
}

/// Result of a search.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Map point of each feature.
    pub matches: Vec<Option<PointId>>,
    /// Points that the camera should see from the pose.
    pub expected: Vec<PointId>,
}

impl Found {
    /// Number of matches.
    pub fn count(&self) -> usize {
        self.matches.iter().flatten().count()
    }
}

/// Where and at which level a point should appear.
struct Prediction {
    pixel: Point2<f32>,
    right_x_px: f32,
    level: usize,
}

impl ProjectionSearch<'_> {
    /// Finds the points in the frame; where two want one feature the more similar, then the older gets it.
    pub fn run(
        &self,
        frame: &FrameFeatures,
        map: &Map,
        points: impl Iterator<Item = PointId>,
        camera_from_world: &Pose,
    ) -> Found {
        let mut best: Vec<Option<(u32, PointId)>> = vec![None; frame.len()];
        let mut expected = Vec::new();
        let centre = camera_from_world.inverse_transform_point(&Point3::origin());
        for id in points {
            let Some(point) = map.point(id) else { continue };
            let Some(prediction) = self.predict(point, camera_from_world, &centre) else { continue };
            expected.push(id);
            let Some((distance, feature)) = nearest_feature(self, frame, &prediction, &point.descriptor)
            else {
                continue;
            };
            if best[feature].is_none_or(|current| (distance, id) < current) {
                best[feature] = Some((distance, id));
            }
        }
        Found { matches: best.into_iter().map(|entry| entry.map(|(_, id)| id)).collect(), expected }
    }

    fn predict(
        &self,
        point: &crate::map::MapPoint,
        camera_from_world: &Pose,
        centre_in_world: &Point3<f64>,
    ) -> Option<Prediction> {
        let point_in_camera = camera_from_world * point.position_in_world;
        let camera = &self.rig.left;
        if point_in_camera.z.is_nan() || point_in_camera.z <= 0.0 {
            return None;
        }
        let projected = reprojection::project(self.rig, &point_in_camera);
        let inside = |value: f64, length: u32| (-0.5..f64::from(length) - 0.5).contains(&value);
        if !inside(projected.x, camera.width_px) || !inside(projected.y, camera.height_px) {
            return None;
        }
        let view = point.position_in_world - centre_in_world;
        let distance_m = view.norm();
        if view.dot(&point.view_direction) < distance_m * self.config.view_angle_max_deg.to_radians().cos() {
            return None;
        }
        let level = self.level_at(point.finest_distance_m / distance_m)?;
        let pixel = Point2::new(projected.x as f32, projected.y as f32);
        Some(Prediction { pixel, right_x_px: projected.z as f32, level })
    }

    /// The level whose scale is nearest to a ratio of distances; `None` more than one level outside the pyramid.
    fn level_at(&self, scale: f64) -> Option<usize> {
        let last = self.scales.len() - 1;
        let factor = if last > 0 { f64::from(self.scales[1]) } else { 2.0 };
        let level = scale.ln() / factor.ln();
        let reachable = level > -1.5 && level < last as f64 + 1.5;
        reachable.then(|| (level.round().max(0.0) as usize).min(last))
    }
}

dispatch! {
    /// Distance and index of the most similar feature in the window; `None` where two are alike.
    fn nearest_feature(search: &ProjectionSearch, frame: &FrameFeatures, prediction: &Prediction, descriptor: &Descriptor) -> Option<(u32, usize)> = nearest_feature_portable;
}

#[inline(always)]
fn nearest_feature_portable(
    search: &ProjectionSearch,
    frame: &FrameFeatures,
    prediction: &Prediction,
    descriptor: &Descriptor,
) -> Option<(u32, usize)> {
    let radius = search.radius_px * search.scales[prediction.level];
    let mut best = (u32::MAX, usize::MAX);
    let mut second = u32::MAX;
    for feature in frame.grid.near(&prediction.pixel, radius) {
        let keypoint = &frame.features.keypoints[feature];
        let offset = keypoint.pixel - prediction.pixel;
        if offset.x.abs() > radius
            || offset.y.abs() > radius
            || usize::from(keypoint.level).abs_diff(prediction.level) > 1
            || frame.stereo[feature].is_some_and(|s| (s.right_x_px - prediction.right_x_px).abs() > radius)
        {
            continue;
        }
        let distance = descriptor.distance(&frame.features.descriptors[feature]);
        if distance < best.0 {
            second = best.0;
            best = (distance, feature);
        } else {
            second = second.min(distance);
        }
    }
    let distinct = (best.0 as f32) < search.config.ratio * second as f32;
    (best.0 <= search.config.distance_max_bits && distinct).then_some(best)
}
