//! What a session has fused so far, from its journal: enough to rebuild a model that was lost with its GPU.

use std::collections::BTreeSet;
use std::path::PathBuf;

use geometry::Pose;
use geometry::trajectory::StampedPose;
use recording::{RecordingConfig, RecordingError, RecordingReader, StereoMessage};

use super::mailbox::Policy;
use super::worker::StereoPair;

/// Where the journal is, and how much of it a rebuilt model is made from.
#[derive(Clone, Debug)]
pub struct History {
    /// The journal, which may still grow.
    pub journal: PathBuf,
    /// Its format.
    pub recording: RecordingConfig,
    /// Pairs at most, spread evenly over the session: rebuilding must not take longer than what came before.
    pub pairs_max: usize,
}

impl History {
    /// Pairs from `since_ns` on with the poses that were found for them, oldest first. Pairs that cannot be read are left out.
    ///
    /// # Errors
    /// [`RecordingError`] where the journal cannot be read.
    pub fn pairs(&self, since_ns: u64) -> Result<impl Iterator<Item = (StereoPair, Pose)>, RecordingError> {
        let reader = RecordingReader::open(&self.journal, &self.recording)?;
        let size_px = reader.calibration()?.image_size_px();
        let mut poses = reader.estimated_poses()?;
        poses.retain(|pose| pose.stamp_ns >= since_ns);
        let poses = spread(&poses, self.pairs_max);
        let stamps: BTreeSet<u64> = poses.iter().map(|pose| pose.stamp_ns).collect();
        let wanted = reader.stereo()?.filter_map(Result::ok);
        let wanted = wanted.filter(move |message| stamps.contains(&message.stamp_ns));
        Ok(wanted.enumerate().filter_map(move |(sequence, message)| {
            let pose = poses.iter().find(|pose| pose.stamp_ns == message.stamp_ns)?;
            Some((decode(&message, sequence as u64, size_px)?, pose.world_from_camera))
        }))
    }
}

fn decode(message: &StereoMessage, sequence: u64, size_px: (u32, u32)) -> Option<StereoPair> {
    let mask = message.mask.as_ref().and_then(|mask| recording::decode_gray(mask, size_px).ok());
    Some(StereoPair {
        stamp_ns: message.stamp_ns,
        sequence,
        left: recording::decode_rgb(&message.left, size_px).ok()?,
        right: recording::decode_rgb(&message.right, size_px).ok()?,
        mask,
        policy: Policy::Lossless,
    })
}

/// At most so many of the poses, evenly spread, the newest among them.
fn spread(poses: &[StampedPose], most: usize) -> Vec<StampedPose> {
    let step = poses.len().div_ceil(most.max(1)).max(1);
    let mut kept: Vec<StampedPose> = poses.iter().rev().step_by(step).copied().collect();
    kept.reverse();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_session_is_rebuilt_from_evenly_spread_pairs() {
        let pose = |stamp_ns| StampedPose { stamp_ns, world_from_camera: Pose::identity() };
        let poses: Vec<StampedPose> = (0..1000).map(pose).collect();
        let kept: Vec<u64> = spread(&poses, 10).iter().map(|pose| pose.stamp_ns).collect();
        assert_eq!(kept, [99, 199, 299, 399, 499, 599, 699, 799, 899, 999]);
        assert_eq!(spread(&poses[..7], 10).len(), 7);
        assert!(spread(&[], 10).is_empty());
    }
}
