//! The recording's material points, as the follower needs them.

use std::collections::BTreeMap;

use geometry::Pose;
use nalgebra::Point3;
use recording::{RecordingError, RecordingReader};

/// Truth points of every pair in the truth's camera frame, by stamp.
#[derive(Default)]
pub struct PointTruth {
    in_camera: BTreeMap<u64, Vec<(u32, Point3<f64>)>>,
}

impl PointTruth {
    /// Reads them all; empty where the recording has no points or no poses.
    pub fn load(reader: &RecordingReader) -> Result<Self, RecordingError> {
        let poses: BTreeMap<u64, Pose> =
            reader.poses()?.into_iter().map(|pose| (pose.stamp_ns, pose.world_from_camera)).collect();
        let mut in_camera = BTreeMap::new();
        for points in reader.points()? {
            let points = points?;
            if let Some(world_from_camera) = poses.get(&points.stamp_ns) {
                let camera_from_world = world_from_camera.inverse();
                let moved = points.points_in_world.iter().map(|point| camera_from_world * point);
                in_camera.insert(points.stamp_ns, points.ids.iter().copied().zip(moved).collect());
            }
        }
        Ok(Self { in_camera })
    }

    /// Whether there is anything to follow.
    pub fn is_empty(&self) -> bool {
        self.in_camera.is_empty()
    }

    /// The points at a stamp.
    pub fn at(&self, stamp_ns: u64) -> &[(u32, Point3<f64>)] {
        self.in_camera.get(&stamp_ns).map_or(&[], Vec::as_slice)
    }
}
