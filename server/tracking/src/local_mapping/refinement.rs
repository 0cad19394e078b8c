//! The points that a new keyframe sees are placed anew from their latest sightings.
//!
//! Only the latest count: tissue moves, and a point should be where it is now.

use geometry::StereoRig;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::config::{MapConfig, PoseConfig};
use crate::map::{KeyframeId, Map, MapPoint, PointId};
use crate::solve::structure::{Sighting, refine_point};

/// Refines positions and looks of all points that a keyframe sees.
pub fn refine_points(
    map: &mut Map,
    keyframe: KeyframeId,
    rig: &StereoRig,
    scales: &[f32],
    (pose_config, map_config): (&PoseConfig, &MapConfig),
) {
    let Some(ids) = map.keyframe(keyframe).map(|keyframe| keyframe.points().to_vec()) else { return };
    let ids: Vec<PointId> = ids.into_iter().flatten().collect();
    let refined: Vec<Option<Point3<f64>>> = ids
        .par_iter()
        .map(|&id| refined_position(map, map.point(id)?, rig, scales, (pose_config, map_config)))
        .collect();
    for (id, position) in ids.into_iter().zip(refined) {
        if let (Some(point), Some(position)) = (map.point_mut(id), position) {
            point.position_in_world = position;
        }
        map.summarise_point(id, scales);
    }
}

/// `None` for points with one sighting: they are where stereo put them.
fn refined_position(
    map: &Map,
    point: &MapPoint,
    rig: &StereoRig,
    scales: &[f32],
    (pose_config, map_config): (&PoseConfig, &MapConfig),
) -> Option<Point3<f64>> {
    if point.seen().len() < 2 {
        return None;
    }
    let latest = point.seen().iter().rev().take(map_config.refine_observations as usize);
    let sightings: Vec<Sighting> = latest
        .filter_map(|seen| {
            let keyframe = map.keyframe(seen.keyframe)?;
            let observation = keyframe.frame.observation(seen.feature, scales, pose_config);
            Some(Sighting { camera_from_world: &keyframe.camera_from_world, observation })
        })
        .collect();
    refine_point(rig, &point.position_in_world, &sightings)
}
