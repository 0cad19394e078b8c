//! The scope is somewhere else before there is a map to find it in: the model begins anew, and viewers with it.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use protocol::v1::RigidTransform;
use replica::Replica;
use simulator::{SceneConfig, SceneKind};
use support::endoscopy::Endoscopy;

/// More than `tracking.recovery.restart_frames`.
const FRAMES: usize = 24;

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_that_was_left_before_it_was_mapped_is_not_in_the_model_of_the_next() {
    let mut session = Endoscopy::start().await;
    let elsewhere = session.pairs(|liver| SceneConfig { scene: SceneKind::Heart, seed: 5, ..liver }, "heart");
    session.feed(elsewhere.take(4)).await;
    session.server.state_when("a", |state| state["surfels"].as_u64() > Some(50)).await;
    let mut viewer = session.server.join("/api/sessions/a/view").await;
    let mut model = Replica::default();
    viewer.follow_model(&mut model, |model| model.surfels().len() > 50).await;

    let liver = session.pairs(|liver| SceneConfig { frames: FRAMES as u32, ..liver }, "liver");
    let poses = session.feed(liver).await;
    let first = poses.iter().position(|pose| pose.world_from_camera.is_some()).expect("tracked again");
    assert!(first > 10, "a cut is not tracked through: {first}");
    let at_origin = RigidTransform { qw: 1.0, ..RigidTransform::default() };
    assert_eq!(poses[first].world_from_camera, Some(at_origin), "a new world");
    let state = session.server.state_when("a", |state| state["surfels"].as_u64() > Some(50)).await;
    assert!(state["alarms"][0].as_str().unwrap().contains("begins anew"), "{state}");

    // Who was there before holds what a newcomer is given, and nothing of the heart.
    let mut other = session.server.join("/api/sessions/a/view").await;
    let mut late = Replica::default();
    other.follow_model(&mut late, Replica::is_current).await;
    viewer.follow_model(&mut model, |held| held.is_current() && held.epoch() >= late.epoch()).await;
    assert_eq!(model.digest(), late.digest());
}
