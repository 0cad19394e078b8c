//! The whole system at work: carts, server, browser.

use std::time::{Duration, Instant};

use serde_json::Value;
use tests::browser::{Browser, Observation};
use tests::cart::Cart;
use tests::server::Server;
use tests::{data, process};

/// Small pictures: the tests run on software Vulkan.
const SMALL: &[&str] = &["--size", "320x240", "--frames", "60", "--fps", "10", "--rigid"];

fn has_model(session: &Value) -> Option<()> {
    (session["surfels"].as_u64()? > 300 && session["frames_fused"].as_u64()? > 4).then_some(())
}

#[test]
fn two_carts_over_zenoh_and_websocket_are_shown_by_a_browser_and_a_killed_one_is_told() {
    let scratch = tempfile::tempdir().unwrap();
    let liver = data::simulate(scratch.path(), "one", SMALL);
    let other = data::simulate(scratch.path(), "other", &[SMALL, &["--seed", "5"]].concat());
    let server = Server::start(&["session.source_silence_s=1.0"]);
    let mut by_socket = Cart::start(&liver, &server.ws(), "theatre-1");
    let mut by_zenoh = Cart::start(&other, &format!("zenoh/{}", server.zenoh), "theatre-2");
    for session in ["theatre-1", "theatre-2"] {
        server.wait_for("/api/sessions", |sessions| {
            has_model(sessions.as_array()?.iter().find(|found| found["session"] == session)?)
        });
    }

    for (session, cart) in [("theatre-1", &mut by_socket), ("theatre-2", &mut by_zenoh)] {
        let path = format!("/api/sessions/{session}");
        assert_eq!(server.get(&path)["status"], "live");
        cart.kill();
        let killed = Instant::now();
        server.wait_for(&path, |state| (state["status"] == "source_lost").then_some(()));
        assert!(killed.elapsed() < Duration::from_secs(2), "{:?}", killed.elapsed());

        server.wait_until_still(&path);
        let screenshot = scratch.path().join(session).with_extension("png");
        let seen = Browser::open(&Observation {
            url: &server.http,
            session: Some(session),
            until: "misSlam.following && misSlam.state === 'source_lost' && misSlam.framesDrawn > 2 && misSlam.previews > 0 && misSlam.surfels === misSlam.serverSurfels",
            screenshot: &screenshot,
        })
        .finish();
        assert!(seen.fulfilled, "{seen:#?}");
        assert!(seen.not_blank && seen.console.is_empty(), "{seen:#?}");
        assert_eq!(seen.status["surfels"], server.get(&path)["surfels"]);
        assert!(seen.status["surfels"].as_u64().unwrap() > 300, "{seen:#?}");
    }
}

#[test]
fn a_browser_follows_a_live_model_and_lists_the_session() {
    let scratch = tempfile::tempdir().unwrap();
    let liver = data::simulate(scratch.path(), "liver", SMALL);
    let server = Server::start(&[]);
    let _cart = Cart::start(&liver, &server.ws(), "live");
    let screenshot = scratch.path().join("live.png");
    let seen = Browser::open(&Observation {
        url: &server.http,
        session: Some("live"),
        until: "misSlam.following && misSlam.epoch > 5 && misSlam.surfels > 300 && misSlam.poses > 5 && misSlam.previews > 2",
        screenshot: &screenshot,
    })
    .finish();
    assert!(seen.fulfilled && seen.not_blank && seen.console.is_empty(), "{seen:#?}");
    assert_eq!(seen.status["state"], "live");

    let list = Browser::open(&Observation {
        url: &server.http,
        session: None,
        until: "misSlam.sessions !== null && misSlam.sessions.includes('live')",
        screenshot: &scratch.path().join("list.png"),
    })
    .finish();
    assert!(list.fulfilled && list.console.is_empty(), "{list:#?}");
}

#[test]
fn sigterm_drains_and_ends_with_success() {
    let scratch = tempfile::tempdir().unwrap();
    let liver = data::simulate(scratch.path(), "liver", SMALL);
    let mut server = Server::start(&[]);
    let _cart = Cart::start(&liver, &server.ws(), "live");
    server.wait_for("/api/sessions", |sessions| has_model(sessions.get(0)?));
    let started = Instant::now();
    let status = server.terminate();
    assert!(status.success(), "{status}");
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
}

#[test]
fn a_headless_demo_leaves_a_report_and_a_picture() {
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("demo");
    let mut command = process::program("mis-slam");
    command.args(["demo", "--headless", "--frames", "12", "--out"]).arg(&out);
    command.args(["--set", "simulate.width_px=320", "--set", "simulate.height_px=240"]);
    process::run(command);
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    assert!(report["frames"]["fused"].as_u64().unwrap() >= 3, "{report:#}");
    assert!(report["surfels"].as_u64().unwrap() > 100, "{report:#}");
    assert!(std::fs::metadata(out.join("model.png")).unwrap().len() > 2000);
}
