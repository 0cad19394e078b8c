//! The truth of a recording, in the world that a replay uses: the left camera of the first frame.

mod mesh_archive;
mod moving_mesh;

use std::collections::BTreeMap;

use geometry::trajectory::StampedPose;
use geometry::{Pinhole, Pose, Rectification};
use nalgebra::Point3;
use recording::{Calibration, RecordingReader, StampedDepth, TruthPoints};

use crate::EvaluationError;
pub(crate) use moving_mesh::MovingMesh;

/// Name of the attachment with the deforming surface.
const MESH_ATTACHMENT: &str = "truth_mesh.npz";

/// Material points at one time, by their ids.
pub(crate) type PointsById = BTreeMap<u32, Point3<f64>>;

/// What a recording says is true, read once for all that is compared with it.
pub struct Truth<'a> {
    recording: &'a RecordingReader,
    /// Stamps of the stereo pairs; a frame is an index into them.
    pub(crate) frame_stamps_ns: Vec<u64>,
    poses: BTreeMap<u64, Pose>,
    points: BTreeMap<u64, PointsById>,
    /// Points in the first message of true points.
    pub(crate) points_at_first: usize,
    /// The simulator's surface, if the recording is simulated.
    pub(crate) mesh: Option<MovingMesh>,
    /// From the world of the recording to that of its first left camera.
    pub(crate) world_from_recorded: Pose,
}

impl<'a> Truth<'a> {
    /// Reads everything but the depth maps, which are read one at a time when they are compared.
    ///
    /// # Errors
    /// [`EvaluationError`] where the recording holds no pair or cannot be read.
    pub fn read(recording: &'a RecordingReader) -> Result<Self, EvaluationError> {
        let pairs = recording.stereo()?.map(|pair| Ok::<_, EvaluationError>(pair?.stamp_ns));
        let frame_stamps_ns = pairs.collect::<Result<Vec<_>, _>>()?;
        let &first_ns = frame_stamps_ns.first().ok_or(EvaluationError::NoFrames)?;
        let mut poses: BTreeMap<u64, Pose> =
            recording.poses()?.into_iter().map(|pose| (pose.stamp_ns, pose.world_from_camera)).collect();
        let world_from_recorded = poses.get(&first_ns).map_or_else(Pose::identity, Pose::inverse);
        for pose in poses.values_mut() {
            *pose = world_from_recorded * *pose;
        }
        let mut points = BTreeMap::new();
        let mut points_at_first = None;
        for moment in recording.points()? {
            let TruthPoints { stamp_ns, ids, points_in_world } = moment?;
            points_at_first.get_or_insert(ids.len());
            let in_world = points_in_world.iter().map(|point| world_from_recorded * point);
            points.insert(stamp_ns, ids.into_iter().zip(in_world).collect());
        }
        let mesh = recording.attachment(MESH_ATTACHMENT)?;
        Ok(Self {
            recording,
            frame_stamps_ns,
            poses,
            points,
            points_at_first: points_at_first.unwrap_or(0),
            mesh: mesh.map(MovingMesh::from_npz).transpose()?,
            world_from_recorded,
        })
    }

    /// Stamps of the stereo pairs, ascending; a frame is an index into them.
    pub fn frame_stamps_ns(&self) -> &[u64] {
        &self.frame_stamps_ns
    }

    /// The scope's true path, by stamp.
    pub fn trajectory(&self) -> Vec<StampedPose> {
        let stamped =
            |(&stamp_ns, &world_from_camera): (&u64, &Pose)| StampedPose { stamp_ns, world_from_camera };
        self.poses.iter().map(stamped).collect()
    }

    /// The last frame.
    pub(crate) fn last_frame(&self) -> usize {
        self.frame_stamps_ns.len() - 1
    }

    /// The frame of a stamp.
    pub(crate) fn frame(&self, stamp_ns: u64) -> Option<usize> {
        self.frame_stamps_ns.binary_search(&stamp_ns).ok()
    }

    /// How many true poses there are, in frames or between.
    pub(crate) fn pose_count(&self) -> usize {
        self.poses.len()
    }

    /// The true pose in a frame.
    pub(crate) fn world_from_camera(&self, frame: usize) -> Option<Pose> {
        self.poses.get(self.frame_stamps_ns.get(frame)?).copied()
    }

    /// Whether there are true points at any time.
    pub(crate) fn has_points(&self) -> bool {
        !self.points.is_empty()
    }

    /// The true points in a frame.
    pub(crate) fn points(&self, frame: usize) -> Option<&PointsById> {
        self.points.get(self.frame_stamps_ns.get(frame)?)
    }

    /// The true depth maps, read one at a time.
    pub(crate) fn depths(
        &self,
    ) -> Result<impl Iterator<Item = Result<StampedDepth, EvaluationError>> + '_, EvaluationError> {
        Ok(self.recording.depths()?.map(|depth| Ok(depth?)))
    }

    /// The rectified left camera.
    pub(crate) fn left_pinhole(&self) -> Result<Pinhole, EvaluationError> {
        match self.recording.calibration()? {
            Calibration::Rectified(rig) => Ok(rig.left),
            Calibration::Raw(raw) => Ok(Rectification::from_calibration(&raw)?.rig().left),
        }
    }
}
