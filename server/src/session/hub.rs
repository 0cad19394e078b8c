//! What ingest, reconstruction and viewers of one session share: its facts, counts and lanes.
//!
//! Facts lie behind one lock that is never held while something is encoded, sent or waited for.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use geometry::trajectory::StampedPose;
use protocol::v1::{
    Camera, EncodedImage, ImageFeatures, Pose, PreviewImage, Reason, ReplayPosition, RigidTransform,
    SessionState, SessionStatus, SharedChange, StereoPair, TrackingOutcome, from_server,
};
use protocol::{Bytes, ProtocolError, SessionId};
use tokio::sync::{broadcast, watch};

use super::SessionConfig;
use super::intake::{Intake, Rejection};
use super::journal::{Entry, JournalInlet};
use super::lifecycle::{Claim, Closing, Event, Lifecycle, SourceBusy, SourceId};
use super::mailbox::{Offer, Policy};
use super::shared_scene::SharedScene;
use super::tally::{Arrivals, Drops, Meter};
use super::trajectory::Trajectory;
use crate::convert;
use crate::publish::PublishConfig;
use crate::publish::model_lane::{ModelLane, ModelUpdate};

/// Refusals that wait for a slow cart; older ones are forgotten, the counts stay.
const REFUSALS_WAITING_MAX: usize = 64;

/// Alarms kept; what comes after so many says nothing new.
const ALARMS_MAX: usize = 8;

/// What the tracker found in one pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseUpdate {
    /// Of the pair.
    pub stamp_ns: u64,
    /// Of the pair.
    pub sequence: u64,
    /// What is known.
    pub outcome: TrackingOutcome,
    /// None unless tracked or recovered.
    pub world_from_camera: Option<RigidTransform>,
    /// Features matched to the map.
    pub matched_features: u32,
    /// Time since the loss; 0 unless lost.
    pub lost_for_ns: u64,
    /// Whether the picture is fit for fusion: its name for people.
    pub picture: &'static str,
}

/// One session's shared part.
pub struct Hub {
    id: SessionId,
    takeover_token: String,
    facts: Mutex<Facts>,
    /// Where what comes and what is found is written down, while it is.
    journal: Mutex<Option<JournalInlet>>,
    shared_scene: Mutex<SharedScene>,
    trajectory: Mutex<Trajectory>,
    /// Newest pose.
    pub pose: watch::Sender<Option<Bytes>>,
    /// Newest state.
    pub state: watch::Sender<Option<Bytes>>,
    /// Newest left image.
    pub preview: watch::Sender<Option<Bytes>>,
    /// What the tracker found in the newest left image; nobody may follow it.
    pub features: watch::Sender<Option<Bytes>>,
    /// What the viewers share.
    pub shared: watch::Sender<Option<Bytes>>,
    /// The model.
    pub model: ModelLane,
    /// Refusals of single pairs, for the cart.
    pub refusals: broadcast::Sender<Bytes>,
    /// How the session ended, once it has.
    pub closing: watch::Sender<Option<Closing>>,
}

struct Facts {
    lifecycle: Lifecycle,
    intake: Intake,
    drops: Drops,
    received: Meter,
    poses: Meter,
    fused: Meter,
    arrivals: Arrivals,
    pair_at: Option<Instant>,
    /// Arrival of the pair that the newest pose belongs to.
    pose_of: Option<Instant>,
    /// Arrival of the newest pair in the published model.
    model_of: Option<Instant>,
    tracking: TrackingOutcome,
    picture: &'static str,
    /// The rectified left camera.
    camera: Option<Camera>,
    model_stale: bool,
    recording: bool,
    alarms: Vec<String>,
    replay: Option<ReplayPosition>,
    /// Counts the reconstructions begun.
    reconstruction: u32,
}

impl Hub {
    /// A session that waits for its cart.
    pub fn new(
        id: SessionId,
        takeover_token: String,
        size_px: (u32, u32),
        (session, publish): (&SessionConfig, &PublishConfig),
    ) -> Self {
        let stamp_lead_max = Duration::from_secs_f64(session.stamp_lead_max_s);
        let facts = Facts {
            lifecycle: Lifecycle::new(session, Instant::now()),
            intake: Intake::new(size_px, stamp_lead_max),
            drops: Drops::default(),
            received: Meter::default(),
            poses: Meter::default(),
            fused: Meter::default(),
            arrivals: Arrivals::default(),
            pair_at: None,
            pose_of: None,
            model_of: None,
            tracking: TrackingOutcome::Unspecified,
            picture: "",
            camera: None,
            model_stale: false,
            recording: false,
            alarms: Vec::new(),
            replay: None,
            reconstruction: 1,
        };
        let hub = Self {
            id,
            takeover_token,
            facts: Mutex::new(facts),
            journal: Mutex::new(None),
            shared_scene: Mutex::default(),
            trajectory: Mutex::default(),
            pose: watch::Sender::new(None),
            state: watch::Sender::new(None),
            preview: watch::Sender::new(None),
            features: watch::Sender::new(None),
            shared: watch::Sender::new(None),
            model: ModelLane::new(publish.lag_limits()),
            refusals: broadcast::Sender::new(REFUSALS_WAITING_MAX),
            closing: watch::Sender::new(None),
        };
        hub.publish_state();
        hub
    }

    /// The session's id.
    pub fn id(&self) -> &SessionId {
        &self.id
    }

    fn facts(&self) -> MutexGuard<'_, Facts> {
        self.facts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// With it a cart may take the session over from another one.
    pub fn takeover_token(&self) -> &str {
        &self.takeover_token
    }

    /// A source starts to feed the session; `presented` is the takeover token that it has, or an empty text.
    ///
    /// # Errors
    /// [`SourceBusy`] while another one does.
    pub fn join(&self, source: SourceId, presented: &str) -> Result<(), SourceBusy> {
        let claim =
            if same_secret(presented, &self.takeover_token) { Claim::Takeover } else { Claim::Polite };
        self.facts().lifecycle.join(source, claim, Instant::now())?;
        self.publish_state();
        Ok(())
    }

    /// A cart is gone.
    pub fn leave(&self, source: &SourceId) {
        self.happen(Event::SourceLeft(source.clone()));
    }

    /// Tells the session something; a change of status is published at once.
    pub fn happen(&self, event: Event) {
        let changed = {
            let mut facts = self.facts();
            let changed = facts.lifecycle.handle(event, Instant::now());
            let lifecycle = &facts.lifecycle;
            changed.then(|| (lifecycle.status(), lifecycle.text().to_owned(), lifecycle.closing()))
        };
        let Some((status, text, closing)) = changed else { return };
        tracing::info!(session = %self.id, status = status.name(), text, "session status");
        self.publish_state();
        if closing.is_some() {
            self.closing.send_replace(closing);
            self.model.close();
        }
    }

    /// The status as of the last event.
    pub fn status(&self) -> SessionStatus {
        self.facts().lifecycle.status()
    }

    /// The cart that feeds the session.
    pub fn source(&self) -> Option<SourceId> {
        self.facts().lifecycle.source().cloned()
    }

    /// Whether this cart feeds the session.
    pub fn is_fed_by(&self, source: &SourceId) -> bool {
        self.facts().lifecycle.is_fed_by(source)
    }

    /// Judges a pair by its header; counts it either way.
    ///
    /// # Errors
    /// [`Rejection`], already counted.
    pub fn admit(&self, source: &SourceId, pair: &StereoPair) -> Result<(), Rejection> {
        let now = Instant::now();
        let admitted = {
            let mut facts = self.facts();
            if !facts.lifecycle.is_fed_by(source) {
                let text = "this cart does not feed the session any more";
                return Err(Rejection::new(Reason::TakenOver, text));
            }
            facts.received.count(now);
            let admitted = facts.intake.admit(pair, source.origin(), now);
            if admitted.is_ok() {
                facts.arrivals.note(pair.stamp_ns, now);
                facts.pair_at = Some(now);
            }
            admitted
        };
        match &admitted {
            Ok(()) => self.happen(Event::PairTaken),
            Err(rejection) => self.count_unusable(rejection.reason),
        }
        admitted
    }

    /// A pair that was taken turns out to be unusable: counted, and the cart is told.
    pub fn reject(&self, sequence: u64, rejection: Rejection) {
        self.count_unusable(rejection.reason);
        let refusal = protocol::refusal(rejection.reason, rejection.text, Some(sequence));
        // Nobody listens: the cart is gone, which is no error.
        let _ = self.refusals.send(protocol::from_server(from_server::Body::Refusal(refusal)));
    }

    /// A good pair that a newer one overtook.
    pub fn count_drop(&self, reason: Reason) {
        self.facts().drops.count(reason);
    }

    fn count_unusable(&self, reason: Reason) {
        self.facts().drops.count(reason);
        self.happen(Event::PairUnusable(reason));
    }

    /// The pairs come from another place of a recording, or another one: the model starts anew.
    ///
    /// # Errors
    /// As [`ModelLane::clear`].
    pub fn restart(&self, size_px: (u32, u32)) -> Result<(), ProtocolError> {
        self.facts().intake.restart(size_px);
        self.begin_anew()
    }

    /// Another reconstruction begins, in a world of its own.
    fn begin_anew(&self) -> Result<(), ProtocolError> {
        self.facts().reconstruction += 1;
        self.trajectory().clear();
        {
            let mut scene = self.shared_scene();
            scene.forget_world();
            self.tell_shared(&scene);
        }
        self.model.clear()?;
        self.happen(Event::Calibrated);
        Ok(())
    }

    /// What comes and what is found is written down from now on, or not any more.
    pub fn set_journal(&self, journal: Option<JournalInlet>) {
        *self.journal.lock().unwrap_or_else(PoisonError::into_inner) = journal;
    }

    /// Writes something down where there is a journal; waits for the disk only under [`Policy::Lossless`].
    pub fn write_down(&self, policy: Policy, entry: Entry) {
        let journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let offer = journal.map(|journal| journal.offer_by(policy, entry));
        if offer == Some(Offer::Superseded) {
            self.count_drop(Reason::NotRecorded);
        }
    }

    /// Whether what is written down will be kept.
    pub fn set_recording(&self, recording: bool) {
        self.facts().recording = recording;
    }

    /// The journal has ended before the session.
    pub fn recording_failed(&self, text: &str) {
        self.set_journal(None);
        self.set_recording(false);
        self.raise_alarm(text);
    }

    /// Says what somebody should look after although the session goes on.
    pub fn raise_alarm(&self, text: &str) {
        {
            let alarms = &mut self.facts().alarms;
            if alarms.len() < ALARMS_MAX && !alarms.iter().any(|known| known == text) {
                alarms.push(text.to_owned());
            }
        }
        self.publish_state();
    }

    /// Whether the model has stopped to follow the poses, as after the loss of the GPU.
    pub fn set_model_stale(&self, stale: bool) {
        self.facts().model_stale = stale;
        self.publish_state();
    }

    /// Whether the model has stopped to follow the poses.
    pub fn model_is_stale(&self) -> bool {
        self.facts().model_stale
    }

    /// Where the replay is.
    pub fn set_replay(&self, position: ReplayPosition) {
        self.facts().replay = Some(position);
    }

    /// The images have another size from now on, and the model starts anew.
    ///
    /// # Errors
    /// As [`ModelLane::clear`].
    pub fn recalibrate(&self, size_px: (u32, u32)) -> Result<(), ProtocolError> {
        self.facts().intake.recalibrate(size_px);
        self.begin_anew()
    }

    /// The reconstruction runs; poses and model refer to this left camera.
    pub fn set_camera(&self, camera: Camera) {
        self.facts().camera = Some(camera);
    }

    /// The reconstruction cannot go on.
    pub fn fail(&self, text: String) {
        self.happen(Event::Failed(text));
    }

    /// Publishes a pose.
    pub fn publish_pose(&self, update: &PoseUpdate) {
        let now = Instant::now();
        let latency = {
            let mut facts = self.facts();
            facts.poses.count(now);
            facts.tracking = update.outcome;
            facts.picture = update.picture;
            facts.pose_of = facts.arrivals.of(update.stamp_ns);
            facts.pose_of.map_or(Duration::ZERO, |arrival| now.duration_since(arrival))
        };
        if let Some(pose) = &update.world_from_camera {
            self.model.set_scope([pose.tx_m, pose.ty_m, pose.tz_m].map(|value| value as f32));
        }
        let pose = Pose {
            stamp_ns: update.stamp_ns,
            sequence: update.sequence,
            outcome: update.outcome.into(),
            world_from_camera: update.world_from_camera,
            matched_features: update.matched_features,
            lost_for_ns: update.lost_for_ns,
            latency_ms: milliseconds(latency),
        };
        self.pose.send_replace(Some(protocol::from_server(from_server::Body::Pose(pose))));
        if let Some(world_from_camera) = update.world_from_camera.as_ref().and_then(convert::pose_from_wire) {
            let pose = StampedPose { stamp_ns: update.stamp_ns, world_from_camera };
            self.trajectory().add(pose);
            self.write_down(Policy::NewestWins, Entry::Pose(pose));
        }
    }

    fn trajectory(&self) -> MutexGuard<'_, Trajectory> {
        self.trajectory.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The poses published since the reconstruction began, oldest first.
    pub fn published_poses(&self) -> Vec<StampedPose> {
        self.trajectory().poses()
    }

    fn shared_scene(&self) -> MutexGuard<'_, SharedScene> {
        self.shared_scene.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what the viewers share, and tells them all.
    ///
    /// # Errors
    /// [`Rejection`]: the change cannot be made.
    pub fn change_shared(&self, change: SharedChange) -> Result<Bytes, Rejection> {
        let mut scene = self.shared_scene();
        scene.apply(change).map_err(|error| Rejection::new(Reason::InvalidChange, error.to_string()))?;
        Ok(self.tell_shared(&scene))
    }

    /// Called under the scene's lock, so that the last change is the last that is told.
    fn tell_shared(&self, scene: &SharedScene) -> Bytes {
        let bytes = protocol::from_server(from_server::Body::Shared(scene.to_wire()));
        self.shared.send_replace(Some(bytes.clone()));
        bytes
    }

    /// Publishes what the tracker found in the next left image.
    pub fn publish_features(&self, features: ImageFeatures) {
        self.features.send_replace(Some(protocol::from_server(from_server::Body::Features(features))));
    }

    /// Publishes a left image.
    pub fn publish_preview(&self, stamp_ns: u64, left: EncodedImage) {
        let preview = PreviewImage { stamp_ns, left: Some(left) };
        self.preview.send_replace(Some(protocol::from_server(from_server::Body::Preview(preview))));
    }

    /// A pair is in the model.
    pub fn count_fused(&self) {
        self.facts().fused.count(Instant::now());
    }

    /// Publishes what the model did.
    ///
    /// # Errors
    /// As [`ModelLane::publish`].
    pub fn publish_model(&self, update: &ModelUpdate) -> Result<(), ProtocolError> {
        let published = self.model.publish(update)?;
        if published.unpackable > 0 {
            let surfels = published.unpackable;
            tracing::warn!(session = %self.id, surfels, "surfels without a packed form were left out");
        }
        let mut facts = self.facts();
        facts.model_of = facts.arrivals.of(update.stamp_ns);
        Ok(())
    }

    /// The state now.
    pub fn snapshot_state(&self) -> SessionState {
        let (epoch, surfels) = self.model.extent();
        let viewers = self.model.viewers();
        let now = Instant::now();
        let facts = self.facts();
        let age_ms = |at: Option<Instant>| at.map(|at| milliseconds(now.duration_since(at)));
        SessionState {
            session: self.id.to_string(),
            status: facts.lifecycle.status().into(),
            text: facts.lifecycle.text().to_owned(),
            source_present: facts.lifecycle.source_present(),
            tracking: facts.tracking.into(),
            pairs_received: facts.received.total(),
            poses_published: facts.poses.total(),
            frames_fused: facts.fused.total(),
            drops: facts.drops.to_wire(),
            received_hz: facts.received.rate_hz(now),
            pose_hz: facts.poses.rate_hz(now),
            fused_hz: facts.fused.rate_hz(now),
            pair_age_ms: age_ms(facts.pair_at),
            pose_age_ms: age_ms(facts.pose_of),
            model_age_ms: age_ms(facts.model_of),
            epoch,
            surfels: surfels as u32,
            viewers: viewers as u32,
            picture: facts.picture.to_owned(),
            camera: facts.camera,
            model_stale: facts.model_stale,
            alarms: facts.alarms.clone(),
            recording: facts.recording,
            replay: facts.replay.clone(),
            span_ns: facts.intake.span().as_nanos() as u64,
            reconstruction: facts.reconstruction,
        }
    }

    /// Publishes the state.
    pub fn publish_state(&self) {
        let state = from_server::Body::State(self.snapshot_state());
        self.state.send_replace(Some(protocol::from_server(state)));
    }
}

/// Takes the same time wherever two texts of one length differ.
fn same_secret(presented: &str, secret: &str) -> bool {
    let differing = presented.bytes().zip(secret.bytes()).fold(0, |sum, (a, b)| sum | (a ^ b));
    presented.len() == secret.len() && !secret.is_empty() && differing == 0
}

fn milliseconds(duration: Duration) -> f32 {
    duration.as_secs_f32() * 1e3
}
