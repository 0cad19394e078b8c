//! The golden model lane, `protocol/golden/model_lane.json`: what the code writes, and what every replica makes of it.
//!
//! `MIS_SLAM_WRITE_GOLDEN=1 cargo test -p replica --test golden` writes it anew; the page's tests read the same file.
#![expect(clippy::unwrap_used, reason = "a test ends at what it does not expect")]

mod support;

use std::path::PathBuf;

use protocol::v1::from_server::Body;
use protocol::{Bytes, decode_from_server};
use replica::{Progress, Replica};
use serde_json::{Value, json};
use support::{Lane, hex};

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../protocol/golden/model_lane.json")
}

/// A session's life: nodes and surfels come, deform, are corrected and go; then what a late joiner is sent.
fn messages() -> (Vec<Body>, Vec<Body>) {
    let mut lane = Lane::default();
    let epochs = (0..8).map(|step| Body::Epoch(lane.advance(step))).collect();
    let snapshot = lane.model.snapshot().expect("a valid model").into_iter();
    (epochs, snapshot.map(|placed| Body::Snapshot(placed.chunk)).collect())
}

/// Positions of a replica after a message, to be compared within a tolerance.
fn state(replica: &Replica) -> Value {
    let table = replica.surfels();
    let surfels: Vec<Value> = table
        .ids()
        .iter()
        .zip(table.rows())
        .map(|(id, row)| {
            let numbers = row.position_in_world_m.into_iter().chain(row.normal_in_world);
            let rounded = numbers.map(|number| (f64::from(number) * 1e9).round() / 1e9);
            let row: Vec<Value> = rounded.map(Value::from).collect();
            [vec![json!(id)], row].concat().into()
        })
        .collect();
    json!({"epoch": replica.epoch(), "digest": replica.digest().value(), "nodes": replica.nodes().len(), "surfels": surfels})
}

fn golden() -> Value {
    let (epochs, snapshot) = messages();
    let mut follower = Replica::from_the_start();
    let mut lane = Vec::new();
    for body in &epochs {
        let Body::Epoch(epoch) = body else { unreachable!("epochs only") };
        assert_eq!(follower.take_epoch(epoch).unwrap(), Progress::Current);
        lane.push(json!({"hex": hex(&protocol::from_server(body.clone())), "after": state(&follower)}));
    }
    let chunks: Vec<_> = snapshot.iter().map(|chunk| hex(&protocol::from_server(chunk.clone()))).collect();
    json!({"epochs": lane, "snapshot": chunks})
}

#[test]
fn the_golden_file_is_what_the_code_writes() {
    let fresh = serde_json::to_string(&golden()).unwrap() + "\n";
    if std::env::var_os("MIS_SLAM_WRITE_GOLDEN").is_some() {
        std::fs::write(path(), &fresh).unwrap();
    }
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(path()).unwrap()).unwrap();
    let bytes = |golden: &Value| {
        let epochs: Vec<Value> =
            golden["epochs"].as_array().unwrap().iter().map(|e| e["hex"].clone()).collect();
        (epochs, golden["snapshot"].clone())
    };
    assert_eq!(bytes(&kept), bytes(&serde_json::from_str(&fresh).unwrap()));
}

#[test]
fn a_replica_makes_of_the_golden_bytes_what_is_written_beside_them() {
    let golden: Value = serde_json::from_str(&std::fs::read_to_string(path()).unwrap()).unwrap();
    let body = |hex: &Value| {
        let bytes = Bytes::from(support::bytes(hex.as_str().unwrap()));
        decode_from_server(bytes).unwrap().body.unwrap()
    };
    let mut follower = Replica::from_the_start();
    for message in golden["epochs"].as_array().unwrap() {
        let Body::Epoch(epoch) = body(&message["hex"]) else { panic!("no epoch") };
        follower.take_epoch(&epoch).unwrap();
        assert_close(&state(&follower), &message["after"], 1e-7);
    }
    let mut joiner = Replica::default();
    for chunk in golden["snapshot"].as_array().unwrap().iter().rev() {
        let Body::Snapshot(chunk) = body(chunk) else { panic!("no chunk") };
        joiner.take_chunk(&chunk).unwrap();
    }
    assert!(joiner.is_current());
    assert_eq!(joiner.digest(), follower.digest());
}

fn assert_close(got: &Value, expected: &Value, tolerance: f64) {
    for key in ["epoch", "digest", "nodes"] {
        assert_eq!(got[key], expected[key]);
    }
    let rows = |state: &Value| state["surfels"].as_array().unwrap().clone();
    assert_eq!(rows(got).len(), rows(expected).len());
    for (got, expected) in rows(got).iter().zip(rows(expected)) {
        let numbers =
            |row: &Value| row.as_array().unwrap().iter().map(|n| n.as_f64().unwrap()).collect::<Vec<_>>();
        let pairs = numbers(got).into_iter().zip(numbers(&expected));
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= tolerance), "{got} {expected}");
    }
}
