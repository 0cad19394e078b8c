//! Follows the truth's material points with the model, for `points.csv`.

use std::collections::BTreeSet;

use geometry::{DepthMap, Pose, StereoRig};
use nalgebra::{Point2, Point3};
use recording::export::TrackedPoint;

/// A truth point is taken up where the measured depth at its pixel is this close to it: elsewhere it is hidden.
const VISIBLE_WITHIN_M: f64 = 2e-3;

/// Chooses the points that a frame sees for the first time, for the model to carry along, and keeps what it says of them.
#[derive(Default)]
pub struct PointFollower {
    taken_up: BTreeSet<u32>,
    estimates: Vec<TrackedPoint>,
}

/// One frame as the follower needs it.
pub struct PointFrame<'a> {
    /// Pair number in the recording.
    pub frame: u32,
    /// The truth's points in the truth's camera frame.
    pub points_in_camera: &'a [(u32, Point3<f64>)],
    /// The estimated pose.
    pub world_from_camera: &'a Pose,
    /// The measured depth.
    pub depth: &'a DepthMap,
}

impl PointFollower {
    /// The points seen for the first time, by id, in the world.
    pub fn take_up(&mut self, rig: &StereoRig, frame: &PointFrame) -> Vec<(u32, Point3<f64>)> {
        let mut fresh = Vec::new();
        for (id, in_camera) in frame.points_in_camera {
            if is_seen(rig, frame.depth, in_camera) && self.taken_up.insert(*id) {
                fresh.push((*id, frame.world_from_camera * in_camera));
            }
        }
        fresh
    }

    /// Notes where the model has the points in a frame.
    pub fn note(&mut self, frame: u32, points_in_world: &[(u32, Point3<f64>)]) {
        let estimate =
            |&(id, point_in_world): &(u32, Point3<f64>)| TrackedPoint { frame, id, point_in_world };
        self.estimates.extend(points_in_world.iter().map(estimate));
    }

    /// All estimates in the order of frames, then of taking up.
    pub fn estimates(&self) -> &[TrackedPoint] {
        &self.estimates
    }
}

fn is_seen(rig: &StereoRig, depth: &DepthMap, in_camera: &Point3<f64>) -> bool {
    if in_camera.z <= 0.0 {
        return false;
    }
    let Point2 { coords } = rig.left.project(in_camera);
    let measured = depth.get(coords.x.round() as i64, coords.y.round() as i64).copied().unwrap_or(0.0);
    measured > 0.0 && (f64::from(measured) - in_camera.z).abs() < VISIBLE_WITHIN_M
}

#[cfg(test)]
mod tests {
    use geometry::Pinhole;

    use super::*;

    const RIG: StereoRig = StereoRig {
        left: Pinhole { width_px: 64, height_px: 48, fx_px: 50.0, fy_px: 50.0, cx_px: 32.0, cy_px: 24.0 },
        baseline_m: 0.005,
        right_cx_px: 32.0,
    };

    fn take_up(
        follower: &mut PointFollower,
        points: &[(u32, Point3<f64>)],
        depth_m: f32,
    ) -> Vec<(u32, Point3<f64>)> {
        let (pose, depth) = (Pose::translation(0.0, 0.0, 1.0), DepthMap::filled(64, 48, depth_m));
        let frame =
            PointFrame { frame: 0, points_in_camera: points, world_from_camera: &pose, depth: &depth };
        follower.take_up(&RIG, &frame)
    }

    #[test]
    fn a_point_is_taken_up_once_where_it_is_seen() {
        let mut follower = PointFollower::default();
        let seen = (4, Point3::new(0.0, 0.0, 0.05));
        let (hidden, behind) = ((5, Point3::new(0.0, 0.0, 0.08)), (6, Point3::new(0.0, 0.0, -0.05)));
        let taken_up = take_up(&mut follower, &[seen, hidden, behind], 0.05);
        assert_eq!(taken_up, [(4, Point3::new(0.0, 0.0, 1.05))]);
        assert!(take_up(&mut follower, &[(4, Point3::new(0.01, 0.0, 0.05))], 0.05).is_empty());
    }

    #[test]
    fn unknown_depth_and_points_outside_the_image_take_up_nothing() {
        let mut follower = PointFollower::default();
        assert!(take_up(&mut follower, &[(1, Point3::new(0.0, 0.0, 0.05))], 0.0).is_empty());
        assert!(take_up(&mut follower, &[(1, Point3::new(1e6, 0.0, 0.05))], 0.05).is_empty());
    }
}
