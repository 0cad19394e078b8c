//! What a perfect tracker of a rigid world would say about a world that deforms.
//!
//! It sees all material points in view without noise and takes them for one rigid body: its pose of a frame is the one under
//! which they lie, in the least-squares sense, where they were in the first frame. Motion that all tissue shares is
//! motion of the camera to it, as it is to any tracker that knows only what the camera sees.

use std::collections::BTreeMap;

use geometry::trajectory::{Scale, umeyama};
use geometry::{DepthMap, Pose, StereoRig};
use nalgebra::{Point3, Translation3, UnitQuaternion};

use crate::Error;
use crate::run::Recording;

/// A point further than this behind the true surface is hidden by it, metres.
const HIDDEN_BEHIND_M: f64 = 2e-3;

/// Estimated and true pose of each frame that has both.
///
/// # Errors
/// A recording without true points or depth.
pub fn perfect_trajectory(recording: &Recording) -> Result<Vec<(Pose, Pose)>, Error> {
    let reader = recording.reader();
    let truth: BTreeMap<u64, Pose> =
        reader.poses()?.into_iter().map(|pose| (pose.stamp_ns, pose.world_from_camera)).collect();
    let mut points = BTreeMap::new();
    for at in reader.points()? {
        let at = at?;
        points.insert(at.stamp_ns, at.points_in_world);
    }
    let first = points.values().next().ok_or("the recording has no true points")?.clone();
    let views = views(recording, &truth, &points)?;
    let poses = points.iter().filter_map(|(stamp_ns, now)| {
        let world_from_camera = truth.get(stamp_ns)?;
        let seen = nearest(&views, *stamp_ns)?;
        let pick = |from: &[Point3<f64>]| seen.iter().map(|&index| from[index]).collect::<Vec<_>>();
        let back = umeyama(&pick(now), &pick(&first), Scale::One)?;
        let rotation = UnitQuaternion::from_rotation_matrix(&back.rotation);
        let first_from_now = Pose::from_parts(Translation3::from(back.translation), rotation);
        Some((first_from_now * world_from_camera, *world_from_camera))
    });
    Ok(poses.collect())
}

/// Indices of the points in view, at each stamp with true depth.
fn views(
    recording: &Recording,
    truth: &BTreeMap<u64, Pose>,
    points: &BTreeMap<u64, Vec<Point3<f64>>>,
) -> Result<BTreeMap<u64, Vec<usize>>, Error> {
    let mut views = BTreeMap::new();
    for depth in recording.reader().depths()? {
        let depth = depth?;
        let (Some(pose), Some(points)) = (truth.get(&depth.stamp_ns), points.get(&depth.stamp_ns)) else {
            continue;
        };
        let camera_from_world = pose.inverse();
        let in_view =
            |&index: &usize| is_in_view(&recording.rig, &depth.depth, &(camera_from_world * points[index]));
        views.insert(depth.stamp_ns, (0..points.len()).filter(in_view).collect());
    }
    Ok(views)
}

fn is_in_view(rig: &StereoRig, depth: &DepthMap, point_in_camera: &Point3<f64>) -> bool {
    if point_in_camera.z <= 0.0 {
        return false;
    }
    let pixel = rig.left.project(point_in_camera);
    let surface_m = depth.get(pixel.x.round() as i64, pixel.y.round() as i64);
    surface_m.is_some_and(|&z| z > 0.0 && point_in_camera.z < f64::from(z) + HIDDEN_BEHIND_M)
}

/// What is in view changes slowly: the view at the nearest stamp with depth.
fn nearest(views: &BTreeMap<u64, Vec<usize>>, stamp_ns: u64) -> Option<&Vec<usize>> {
    let before = views.range(..=stamp_ns).next_back();
    let after = views.range(stamp_ns..).next();
    let near = [before, after].into_iter().flatten().min_by_key(|(stamp, _)| stamp.abs_diff(stamp_ns));
    near.map(|(_, view)| view)
}
