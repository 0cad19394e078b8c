//! Sessions of a real server: kept apart, recorded, recovered after a kill, replayed.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use tests::cart::Cart;
use tests::server::{Server, stored_in};
use tests::{data, process};

/// Small pictures: the tests run on software Vulkan.
const SMALL: &[&str] = &["--size", "320x240", "--frames", "40", "--fps", "10", "--rigid"];

fn fused(session: &Value, frames: u64) -> Option<()> {
    (session["surfels"].as_u64()? > 100 && session["frames_fused"].as_u64()? >= frames).then_some(())
}

#[test]
fn a_killed_server_recovers_its_session_and_the_cart_finds_it_again() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let kept = stored_in(&scratch.path().join("data"));
    let liver = data::simulate(scratch.path(), "liver", SMALL);
    let server = Server::start(&[&kept, "storage.record_all=true"]);
    let cart = Cart::start(&liver, &server.ws(), "theatre");
    let path = "/api/sessions/theatre";
    server.wait_for("/api/sessions", |sessions| fused(sessions.get(0)?, 4));
    let before = server.get(path);
    let address = server.http.trim_start_matches("http://").to_owned();
    // SIGKILL.
    drop(server);
    drop(cart);

    let listen = format!("server.listen={address}");
    let again = Server::start(&[&kept, &listen]);
    let recovered = again.wait_for(path, |state| {
        (state["status"] == "source_lost")
            .then(|| (state["pairs_received"].as_u64(), state["surfels"].as_u64()))
    });
    // At most a second of pairs is lost, 10 at 10 Hz, and what was under way.
    let (pairs, surfels) = (recovered.0.expect("a count"), recovered.1.expect("a count"));
    let received = before["pairs_received"].as_u64().expect("a count");
    assert!(pairs + 11 >= received, "{pairs} of {received} pairs");
    assert!(surfels > 100, "{surfels} surfels");

    let _cart = Cart::start(&liver, &again.ws(), "theatre");
    again.wait_for(path, |state| (state["status"] == "live").then_some(()));
    again.delete(path);
    let finished = again.get("/api/finished");
    let run = finished[0]["run"].as_str().expect("a finished run").to_owned();
    let report = again.get(&format!("/api/finished/{run}/report.json"));
    assert!(report["surfels"].as_u64() > Some(100), "{report:#}");
    assert!(report["frames"]["tracked"].as_u64() > Some(4), "{report:#}");
    let ply = again.get_bytes(&format!("/api/finished/{run}/model.ply"));
    assert!(ply.starts_with(b"ply\n") && ply.len() > 2000, "{} bytes", ply.len());

    // The recording is one that the command line replays.
    let recording = scratch.path().join("recorded.mcap");
    std::fs::write(&recording, again.get_bytes(&format!("/api/finished/{run}/recording.mcap")))
        .expect("a file");
    public_tools_read(&recording, pairs as usize);
}

/// The public MCAP packages open a recording and find its topics.
fn public_tools_read(recording: &Path, pairs_min: usize) {
    let Some(python) = data::python() else { return };
    let mut command = Command::new(python);
    command.arg(data::workspace().join("tests/compat/read_recording.py")).arg(recording);
    let output = process::run(command);
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let pairs = found["topics"]["/stereo/left/image"]["stamps"].as_array().map_or(0, Vec::len);
    assert!(pairs >= pairs_min, "{pairs} of {pairs_min} pairs");
    for topic in ["/stereo/right/image", "/stereo/left/calibration", "/mis_slam/pose", "/mis_slam/model"] {
        assert!(found["topics"].get(topic).is_some(), "{topic}: {found:#}");
    }
}

#[test]
fn two_replays_at_once_do_not_mix_and_share_the_gpu() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let (one, other) = (
        data::simulate(scratch.path(), "one", SMALL),
        data::simulate(scratch.path(), "other", &[SMALL, &["--seed", "5"]].concat()),
    );
    let recordings = scratch.path().join("data/recordings");
    std::fs::create_dir_all(&recordings).expect("a directory");
    let alone = |name: &str, recording: &Path| {
        std::fs::copy(recording, recordings.join(name)).expect("a copy");
        let out = scratch.path().join(name).with_extension("out");
        let mut command = process::program("mis-slam");
        command.arg("replay").arg(recording).arg("--out").arg(&out);
        process::run(command);
        std::fs::read(out.join("model.ply")).expect("a model")
    };
    let expected = [("one.mcap", alone("one.mcap", &one)), ("other.mcap", alone("other.mcap", &other))];

    let server = Server::start(&[&stored_in(&scratch.path().join("data"))]);
    for (name, _) in &expected {
        let id = name.trim_end_matches(".mcap");
        let wanted = json!({"session": id, "replay": {"recording": name, "rate": 0.0}});
        server.post("/api/sessions", &wanted);
    }
    for (name, model) in &expected {
        let path = format!("/api/sessions/{}", name.trim_end_matches(".mcap"));
        server.wait_for(&path, |state| (state["replay"]["ended"] == true).then_some(()));
        server.delete(&path);
        let run = server.get("/api/finished")[0]["run"].as_str().expect("a finished run").to_owned();
        let together = server.get_bytes(&format!("/api/finished/{run}/model.ply"));
        assert!(together == *model, "{name}: the model differs from that of a replay alone");
    }
}
