//! What a viewer makes of the messages of a session.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::{Pinhole, Pose};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use protocol::v1::{self, from_server};
use render::SurfelRow;
use replica::{Progress, Replica, ReplicaError, Surfel};

use crate::scene::Scene;

/// Between two requests for the same snapshot, and after the last sign of one that is on its way.
const RESYNC_INTERVAL: Duration = Duration::from_secs(3);

/// A session as it is followed.
#[derive(Debug, Default)]
pub struct Followed {
    replica: Replica,
    /// What is shown of it.
    pub scene: Scene,
    /// Of the last request for the model, or the last part of it that came.
    last_progress: Option<Instant>,
}

impl Followed {
    /// A connection is open; the model comes anew.
    pub fn connected(&mut self, now: Instant) {
        self.replica.forget();
        self.last_progress = Some(now);
        self.scene.connected = true;
        self.scene.unknown_session = false;
        self.scene.notice.clear();
    }

    /// The connection has ended, or did not come about.
    pub fn disconnected(&mut self, notice: String, unknown_session: bool) {
        self.scene.connected = false;
        self.scene.is_current = false;
        self.scene.unknown_session = unknown_session;
        self.scene.notice = notice;
    }

    /// Takes a message in.
    pub fn take(&mut self, body: from_server::Body, now: Instant) {
        match body {
            from_server::Body::Epoch(epoch) => {
                let shows_the_same = self.scene.is_current && !changes_surfels(&epoch);
                match self.replica.take_epoch(&epoch) {
                    Ok(Progress::Current) if shows_the_same => self.scene.model_age.heard(now),
                    taken => self.model_changed(taken, now),
                }
            }
            from_server::Body::Snapshot(chunk) => {
                let taken = self.replica.take_chunk(&chunk);
                self.model_changed(taken, now);
            }
            from_server::Body::Pose(pose) => {
                self.scene.tracking = pose.outcome();
                let known = pose.world_from_camera.as_ref().and_then(pose_from_wire);
                self.scene.world_from_scope = known.or(self.scene.world_from_scope);
            }
            from_server::Body::State(state) => self.take_state(state, now),
            from_server::Body::Farewell(farewell) => self.scene.notice = farewell.text,
            from_server::Body::Refusal(refusal) => self.scene.notice = refusal.text,
            from_server::Body::Hello(_)
            | from_server::Body::Preview(_)
            | from_server::Body::Features(_)
            | from_server::Body::Shared(_)
            | from_server::Body::Compressed(_) => {}
        }
    }

    /// The epoch that is held, where the model has to be asked for again; it then counts as asked for.
    pub fn resync_due(&mut self, now: Instant) -> Option<u32> {
        let waited = self.last_progress.is_none_or(|last| now.duration_since(last) >= RESYNC_INTERVAL);
        if self.replica.is_current() || !waited {
            return None;
        }
        self.last_progress = Some(now);
        self.scene.resyncs += 1;
        Some(self.replica.epoch())
    }

    fn take_state(&mut self, state: v1::SessionState, now: Instant) {
        if let Some(age) = state.model_age_ms.and_then(|ms| Duration::try_from_secs_f32(ms / 1e3).ok()) {
            self.scene.model_age.server_says(now, age);
        }
        self.scene.camera = state.camera.as_ref().and_then(camera_from_wire).or(self.scene.camera);
        self.scene.tracking = state.tracking();
        self.scene.state = state;
    }

    fn model_changed(&mut self, taken: Result<Progress, ReplicaError>, now: Instant) {
        match taken {
            Ok(Progress::Kept) => return,
            Ok(Progress::Seeding) => self.last_progress = Some(now),
            Ok(Progress::Current) => self.scene.model_age.heard(now),
            Err(error) => tracing::warn!(%error, "the model does not match and is asked for again"),
        }
        self.scene.is_current = self.replica.is_current();
        let held = self.replica.surfels().rows();
        let surfels: Vec<SurfelRow> = if held.is_empty() {
            self.replica.arriving().map(row).collect()
        } else {
            held.iter().map(row).collect()
        };
        self.scene.surfels = Arc::new(surfels);
        self.scene.version += 1;
    }
}

/// Whether surfels come, go or move.
fn changes_surfels(epoch: &v1::ModelEpoch) -> bool {
    let blocks = [&epoch.added, &epoch.updated].into_iter().flatten();
    let lists = blocks.map(|block| &block.ids).chain([&epoch.removed_ids, &epoch.node_transforms]);
    lists.into_iter().any(|list| !list.is_empty())
}

fn row(surfel: &Surfel) -> SurfelRow {
    SurfelRow {
        position_in_world_m: surfel.position_in_world_m,
        normal_in_world: surfel.normal_in_world,
        radius_m: surfel.radius_m,
        color: surfel.color,
        weight: surfel.confidence,
    }
}

/// `None` where the quaternion has no direction or something is not finite.
fn pose_from_wire(wire: &v1::RigidTransform) -> Option<Pose> {
    let quaternion = Quaternion::new(wire.qw, wire.qx, wire.qy, wire.qz);
    let rotation = UnitQuaternion::try_new(quaternion, 0.5)?;
    let translation = Translation3::new(wire.tx_m, wire.ty_m, wire.tz_m);
    let finite = translation.vector.iter().chain(rotation.coords.iter()).all(|value| value.is_finite());
    finite.then(|| Pose::from_parts(translation, rotation))
}

/// `None` of a camera that nothing can be drawn with.
fn camera_from_wire(wire: &v1::Camera) -> Option<Pinhole> {
    let &v1::Camera { width_px, height_px, fx_px, fy_px, cx_px, cy_px } = wire;
    let usable = width_px > 0 && height_px > 0 && fx_px > 0.0 && fy_px > 0.0;
    let finite = [fx_px, fy_px, cx_px, cy_px].iter().all(|value| value.is_finite());
    (usable && finite).then_some(Pinhole { width_px, height_px, fx_px, fy_px, cx_px, cy_px })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_epoch_on_another_base_is_answered_by_one_request_for_the_model() {
        let start = Instant::now();
        let mut followed = Followed::default();
        followed.connected(start);
        assert_eq!(followed.resync_due(start), None, "the snapshot comes by itself");
        assert_eq!(followed.resync_due(start + RESYNC_INTERVAL), Some(0));
        assert_eq!(followed.resync_due(start + RESYNC_INTERVAL), None, "it was asked for");
        assert_eq!(followed.scene.resyncs, 1);
    }

    #[test]
    fn a_pose_without_a_place_keeps_the_last_one_and_says_that_tracking_is_lost() {
        let mut followed = Followed::default();
        let now = Instant::now();
        let place = v1::RigidTransform { tx_m: 0.1, qw: 1.0, ..Default::default() };
        let tracked = v1::TrackingOutcome::Tracked.into();
        let pose = v1::Pose { world_from_camera: Some(place), outcome: tracked, ..Default::default() };
        followed.take(from_server::Body::Pose(pose), now);
        let lost = v1::Pose { outcome: v1::TrackingOutcome::Lost.into(), ..Default::default() };
        followed.take(from_server::Body::Pose(lost), now);
        assert_eq!(followed.scene.world_from_scope, Some(Pose::translation(0.1, 0.0, 0.0)));
        assert_eq!(followed.scene.tracking, v1::TrackingOutcome::Lost);
    }

    #[test]
    fn cameras_and_poses_that_are_none_are_passed_over() {
        let camera = v1::Camera { width_px: 4, height_px: 3, fx_px: 1.0, fy_px: 1.0, cx_px: 1.0, cy_px: 1.0 };
        assert!(camera_from_wire(&camera).is_some());
        assert!(camera_from_wire(&v1::Camera { width_px: 0, ..camera }).is_none());
        assert!(camera_from_wire(&v1::Camera { fx_px: f64::NAN, ..camera }).is_none());
        assert!(pose_from_wire(&v1::RigidTransform::default()).is_none());
        assert!(
            pose_from_wire(&v1::RigidTransform { tx_m: f64::NAN, qw: 1.0, ..Default::default() }).is_none()
        );
    }
}
