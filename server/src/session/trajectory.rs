//! The way of the scope so far, as it was published, for those who ask for it while the session goes on.

use std::collections::VecDeque;

use geometry::trajectory::StampedPose;

/// Poses kept: over nine hours at 30 a second, 64 MiB. The file of a finished session has all of them.
const POSES_MAX: usize = 1 << 20;

/// The newest poses, oldest first.
#[derive(Debug, Default)]
pub struct Trajectory(VecDeque<StampedPose>);

impl Trajectory {
    /// Appends a pose; the oldest one over the limit goes.
    pub fn add(&mut self, pose: StampedPose) {
        if self.0.len() == POSES_MAX {
            self.0.pop_front();
        }
        self.0.push_back(pose);
    }

    /// Another world begins.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// A copy.
    pub fn poses(&self) -> Vec<StampedPose> {
        self.0.iter().copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use geometry::Pose;

    use super::*;

    #[test]
    fn the_oldest_poses_over_the_limit_go() {
        let mut trajectory = Trajectory::default();
        for stamp_ns in 0..POSES_MAX as u64 + 2 {
            trajectory.add(StampedPose { stamp_ns, world_from_camera: Pose::identity() });
        }
        let poses = trajectory.poses();
        assert_eq!((poses.len(), poses[0].stamp_ns), (POSES_MAX, 2));
    }
}
