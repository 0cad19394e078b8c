//! After a crash: what was open is opened again and its journal worked through, then carts are let in.

use std::path::PathBuf;
use std::sync::Arc;

use geometry::Pose;
use geometry::trajectory::StampedPose;
use protocol::v1::SessionStatus;
use recording::{Calibration, RecordingConfig, RecordingError, RecordingReader};

use super::journal::Entry;
use super::lifecycle::SourceId;
use super::live::Session;
use super::mailbox::Policy;
use crate::convert;
use crate::storage::{Run, StorageError};

/// Why a run is not recovered.
#[derive(Debug, thiserror::Error)]
pub enum RecoveryError {
    /// Its journal cannot be used.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Its directory cannot.
    #[error(transparent)]
    Storage(#[from] StorageError),
}

/// A journal that a crash left, and from where on it is worked through.
pub struct LeftJournal {
    reader: RecordingReader,
    path: PathBuf,
    poses: Vec<StampedPose>,
    /// Pairs before this stamp are only kept.
    from_ns: u64,
    /// The cameras.
    pub calibration: Calibration,
    /// The pose of the first pair that is worked through.
    pub world_from_start: Pose,
    /// How much of the session's model is lost, for people; `None` where all is worked through.
    pub lost: Option<String>,
}

impl LeftJournal {
    /// Opens the journal of a run that a crash left; at most `recover_max_s` of its end are worked through.
    ///
    /// # Errors
    /// [`RecoveryError`].
    pub fn open(run: &Run, recover_max_s: f64, config: &RecordingConfig) -> Result<Self, RecoveryError> {
        let path = run.set_crashed_aside()?;
        let reader = RecordingReader::open(&path, config)?;
        let calibration = reader.calibration()?;
        let poses = reader.estimated_poses()?;
        let (from_ns, world_from_start) = resume_at(&poses, recover_max_s);
        let lost = (from_ns > 0).then(|| {
            format!("recovered after a crash: the model shows only what was seen in the last {recover_max_s} s before it")
        });
        Ok(Self { reader, path, poses, from_ns, calibration, world_from_start, lost })
    }

    /// Feeds the journal to the session, then lets carts in. Blocks.
    pub fn feed(self, session: &Arc<Session>) {
        match self.hand_on(session) {
            Ok(pairs) => tracing::info!(session = %session.hub().id(), pairs, "recovered from the journal"),
            Err(error) => {
                session.hub().raise_alarm(&format!("the journal could not be worked through: {error}"));
            }
        }
        session.hub().leave(&SourceId::Journal);
        if let Err(error) = std::fs::remove_file(&self.path) {
            tracing::warn!(path = %self.path.display(), %error, "a journal that is not needed any more stays");
        }
    }

    fn hand_on(&self, session: &Session) -> Result<u64, RecordingError> {
        let hub = session.hub();
        for pose in self.poses.iter().filter(|pose| pose.stamp_ns < self.from_ns) {
            hub.write_down(Policy::Lossless, Entry::Pose(*pose));
        }
        let size_px = self.calibration.image_size_px();
        let mut pairs = 0;
        for message in self.reader.stereo()? {
            if hub.status() == SessionStatus::Closed {
                break;
            }
            let pair = convert::pair_to_wire(message?, pairs, size_px);
            pairs += 1;
            if pair.stamp_ns < self.from_ns {
                hub.write_down(Policy::Lossless, Entry::Pair(pair));
            } else if let Err(rejection) = session.take(&SourceId::Journal, pair, Policy::Lossless) {
                tracing::debug!(session = %hub.id(), %rejection, "a journaled pair is left out");
            }
        }
        Ok(pairs)
    }
}

/// From which stamp on to work a journal through, and the pose there. From the start where it is short enough: the
/// world is then the same as before; else the first pose of the end ties the two worlds together.
fn resume_at(poses: &[StampedPose], recover_max_s: f64) -> (u64, Pose) {
    let (Some(first), Some(last)) = (poses.first(), poses.last()) else { return (0, Pose::identity()) };
    let cutoff_ns = last.stamp_ns.saturating_sub((recover_max_s * 1e9) as u64);
    match poses.iter().find(|pose| pose.stamp_ns >= cutoff_ns) {
        Some(anchor) if first.stamp_ns < cutoff_ns => (anchor.stamp_ns, anchor.world_from_camera),
        _ => (0, Pose::identity()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poses(seconds: std::ops::Range<u64>) -> Vec<StampedPose> {
        let pose = |s: u64| StampedPose {
            stamp_ns: s * 1_000_000_000,
            world_from_camera: Pose::translation(s as f64, 0.0, 0.0),
        };
        seconds.map(pose).collect()
    }

    #[test]
    fn a_short_journal_is_worked_through_from_its_start() {
        assert_eq!(resume_at(&poses(5..60), 120.0), (0, Pose::identity()));
        assert_eq!(resume_at(&[], 120.0), (0, Pose::identity()));
    }

    #[test]
    fn of_a_long_one_the_end_is_tied_to_the_world_by_its_pose() {
        let (from_ns, world_from_start) = resume_at(&poses(0..3600), 120.0);
        assert_eq!(from_ns, 3479 * 1_000_000_000);
        assert_eq!(world_from_start.translation.x, 3479.0);
    }
}
