//! Points too far for stereo, or that the right eye does not show, from two keyframes.

use geometry::triangulate::{Ray, midpoint};
use geometry::{Pose, StereoRig};
use nalgebra::{Matrix3, Point2, Point3, Unit, Vector3};

use super::edit::Edit;
use crate::config::TrackingConfig;
use crate::map::{Keyframe, KeyframeId, Map, Seen};
use crate::solve::structure::{Sighting, refine_point};

/// Distance of a feature from the epipolar line of its counterpart, standard deviations: 95 % for one degree of freedom.
const LINE_DISTANCE_SIGMAS: f64 = 1.96;

/// New points from features that neither keyframe has a point for.
pub fn triangulate(
    map: &Map,
    (newest, neighbour): (KeyframeId, KeyframeId),
    (rig, scales): (&StereoRig, &[f32]),
    config: &TrackingConfig,
) -> Vec<Edit> {
    let (Some(a), Some(b)) = (map.keyframe(newest), map.keyframe(neighbour)) else { return Vec::new() };
    let pair = Pair { a, b, rig, scales, config };
    let mut taken = vec![false; b.frame.len()];
    let mut edits = Vec::new();
    for (feature, candidate) in pair.matches() {
        if taken[candidate] {
            continue;
        }
        if let Some(position_in_world) = pair.locate(feature, candidate) {
            taken[candidate] = true;
            let seen =
                vec![Seen { keyframe: neighbour, feature: candidate }, Seen { keyframe: newest, feature }];
            edits.push(Edit::Add { position_in_world, seen });
        }
    }
    edits
}

struct Pair<'a> {
    a: &'a Keyframe,
    b: &'a Keyframe,
    rig: &'a StereoRig,
    scales: &'a [f32],
    config: &'a TrackingConfig,
}

impl Pair<'_> {
    /// Unmapped features of `a`, each with the most similar one of `b` near its epipolar line.
    fn matches(&self) -> Vec<(usize, usize)> {
        let b_from_a = self.b.camera_from_world * self.a.camera_from_world.inverse();
        let line_from_pixel = fundamental(self.rig, &b_from_a);
        let candidates = self.unmapped(self.b);
        self.unmapped(self.a)
            .into_iter()
            .filter_map(|feature| Some((feature, self.most_similar(feature, &line_from_pixel, &candidates)?)))
            .collect()
    }

    /// Features without a point whose depth stereo does not give well.
    fn unmapped(&self, keyframe: &Keyframe) -> Vec<usize> {
        let depth_max_m = self.config.map.depth_max_baselines * self.rig.baseline_m;
        let near = |feature: usize| {
            keyframe.frame.stereo[feature].is_some_and(|stereo| stereo.depth_m <= depth_max_m)
        };
        (0..keyframe.frame.len())
            .filter(|&feature| keyframe.points()[feature].is_none() && !near(feature))
            .collect()
    }

    fn most_similar(
        &self,
        feature: usize,
        line_from_pixel: &Matrix3<f64>,
        candidates: &[usize],
    ) -> Option<usize> {
        let line = line_from_pixel * self.a.frame.pixel(feature).to_homogeneous();
        let length = line.xy().norm();
        let descriptor = &self.a.frame.features.descriptors[feature];
        let level = self.a.frame.features.keypoints[feature].level;
        let mut best = (u32::MAX, usize::MAX);
        let mut second = u32::MAX;
        for &candidate in candidates {
            let keypoint = &self.b.frame.features.keypoints[candidate];
            let sigma_px = self.config.pose.sigma_px * f64::from(self.scales[usize::from(keypoint.level)]);
            let pixel = self.b.frame.pixel(candidate).to_homogeneous();
            if line.dot(&pixel).abs() > LINE_DISTANCE_SIGMAS * sigma_px * length
                || keypoint.level.abs_diff(level) > 1
            {
                continue;
            }
            let distance = descriptor.distance(&self.b.frame.features.descriptors[candidate]);
            if distance < best.0 {
                second = best.0;
                best = (distance, candidate);
            } else {
                second = second.min(distance);
            }
        }
        let distinct = (best.0 as f32) < self.config.search.ratio * second as f32;
        (best.0 <= self.config.mapping.triangulation_bits_max && distinct).then_some(best.1)
    }

    /// Where two features meet: far enough apart in angle, in front of both cameras, and fitting both.
    fn locate(&self, feature: usize, candidate: usize) -> Option<Point3<f64>> {
        let sides = [(self.a, feature), (self.b, candidate)];
        let rays = sides.map(|(keyframe, feature)| self.ray(keyframe, feature));
        let parallax_cos = rays[0].direction.dot(&rays[1].direction);
        if parallax_cos > self.config.mapping.parallax_min_deg.to_radians().cos() {
            return None;
        }
        let start = midpoint(&rays)?;
        let sightings = sides.map(|(keyframe, feature)| Sighting {
            camera_from_world: &keyframe.camera_from_world,
            observation: keyframe.frame.observation(feature, self.scales, &self.config.pose),
        });
        let point = refine_point(self.rig, &start, &sightings)?;
        let fits =
            |sighting: &Sighting| sighting.observation.fits(self.rig, &(sighting.camera_from_world * point));
        sightings.iter().all(fits).then_some(point)
    }

    fn ray(&self, keyframe: &Keyframe, feature: usize) -> Ray {
        let world_from_camera = keyframe.camera_from_world.inverse();
        let in_camera = self.rig.left.back_project(&keyframe.frame.pixel(feature), 1.0);
        Ray {
            origin: Point3::from(world_from_camera.translation.vector),
            direction: Unit::new_normalize(world_from_camera.rotation * in_camera.coords),
        }
    }
}

/// Takes a pixel of `a` to its epipolar line in `b`: `K^-T [t]x R K^-1` (Hartley and Zisserman 2004, section 9.2).
fn fundamental(rig: &StereoRig, b_from_a: &Pose) -> Matrix3<f64> {
    let camera = &rig.left;
    let inverse = |pixel: Point2<f64>| camera.back_project(&pixel, 1.0).coords;
    let origin: Vector3<f64> = inverse(Point2::origin());
    let inverse_k = Matrix3::from_columns(&[
        inverse(Point2::new(1.0, 0.0)) - origin,
        inverse(Point2::new(0.0, 1.0)) - origin,
        origin,
    ]);
    let essential =
        b_from_a.translation.vector.cross_matrix() * b_from_a.rotation.to_rotation_matrix().matrix();
    inverse_k.transpose() * essential * inverse_k
}
