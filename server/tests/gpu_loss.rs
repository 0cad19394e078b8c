//! The GPU is lost in the middle of a session: poses go on, the model comes back from the journal.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use support::endoscopy::Endoscopy;

#[tokio::test(flavor = "multi_thread")]
async fn poses_go_on_and_the_model_is_rebuilt_from_the_journal() {
    let mut session = Endoscopy::start().await;
    let mut pairs = session.pairs(|liver| liver, "liver");
    session.feed(pairs.by_ref().take(8)).await;
    let before = session.server.state_when("a", |state| state["surfels"].as_u64() > Some(50)).await;

    session.gpu.lose("a drill");
    session.feed(pairs.by_ref().take(3)).await;
    let is_back = |state: &serde_json::Value| state["model_stale"] == false && state["alarms"][0].is_string();
    let after = session.server.state_when("a", is_back).await;
    assert_ne!(after["status"], "failed", "{after}");
    assert!(after["alarms"][0].as_str().unwrap().contains("rebuilt"), "{after}");
    assert!(after["poses_published"].as_u64().unwrap() >= 11, "poses went on: {after}");
    let fused = after["frames_fused"].as_u64().unwrap();
    session.feed(pairs).await;
    let at_end = session.server.state_when("a", |state| state["frames_fused"].as_u64() > Some(fused)).await;
    let (was, is) = (before["surfels"].as_u64().unwrap(), at_end["surfels"].as_u64().unwrap());
    assert!(is * 2 > was, "{is} surfels after the loss, {was} before");
}
