//! A frame becomes a keyframe: its matches become sightings, its other stereo points become map points.

use std::sync::Arc;

use geometry::{Pose, StereoRig};

use crate::config::MapConfig;
use crate::frame::FrameFeatures;
use crate::map::{KeyframeId, Map, PointId, Seen};

/// A frame of known pose and its inlier matches, by feature.
#[derive(Clone, Debug)]
pub struct PosedFrame {
    /// When it was taken.
    pub stamp_ns: u64,
    /// Where from.
    pub camera_from_world: Pose,
    /// Its features.
    pub frame: Arc<FrameFeatures>,
    /// Whether the camera was found not to have moved.
    pub resting: bool,
    /// Map point of each feature that agrees with the pose.
    pub matches: Vec<Option<PointId>>,
}

/// Adds a keyframe, and a point for each unmatched feature whose stereo depth is near enough to be trusted.
pub fn insert_keyframe(map: &mut Map, posed: &PosedFrame, rig: &StereoRig, config: &MapConfig) -> KeyframeId {
    let id = map.add_keyframe(posed.stamp_ns, posed.camera_from_world, Arc::clone(&posed.frame));
    let world_from_camera = posed.camera_from_world.inverse();
    let depth_max_m = config.depth_max_baselines * rig.baseline_m;
    for (feature, matched) in posed.matches.iter().enumerate() {
        let seen = Seen { keyframe: id, feature };
        if let Some(point) = matched {
            map.link(*point, seen);
        } else if posed.frame.stereo[feature].is_some_and(|stereo| stereo.depth_m <= depth_max_m)
            && let Some(position_in_world) = posed.frame.point_in_world(feature, rig, &world_from_camera)
        {
            map.add_point(position_in_world, seen);
        }
    }
    map.set_resting(id, posed.resting);
    map.adopt(id);
    id
}
