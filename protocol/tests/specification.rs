//! SPEC.md names every key, route, limit and reason as the code has them.

use protocol::keys::{self, Lane};
use protocol::v1::{Reason, SessionStatus};
use protocol::{NodePosition, limits, node_digest, routes, surfel_digest};

const SPEC: &str = include_str!("../SPEC.md");

fn assert_stated(text: &str) {
    assert!(SPEC.contains(text), "SPEC.md lacks {text:?}");
}

#[test]
fn every_lane_has_its_key() {
    for lane in Lane::ALL {
        assert_stated(&format!("`mis-slam/<session>/{}`", lane.suffix()));
    }
    let (session, cart) = ("SESSION".parse().unwrap(), "CART".parse().unwrap());
    for key in
        [keys::source_token(&session, &cart), keys::server_token(&session), keys::reply(&session, &cart)]
    {
        assert_stated(&format!("`{}`", key.replace("SESSION", "<session>").replace("CART", "<cart>")));
    }
}

#[test]
fn every_route_is_listed() {
    for route in routes::ALL {
        assert_stated(&format!("`{route}`"));
    }
    assert_stated(&format!("`{}`", routes::TAKEOVER_HEADER));
}

#[test]
fn every_limit_has_its_value() {
    assert_stated(&format!("| characters of a session id | {} |", limits::MAX_SESSION_ID_CHARS));
    assert_stated(&format!("| surfels in one block | {} |", limits::MAX_SURFELS_PER_MESSAGE));
    assert_stated(&format!("| deformation nodes | {} |", limits::MAX_NODES));
    assert_stated(&format!(
        "| bytes of a message from the server, decompressed | {} |",
        limits::MAX_MESSAGE_BYTES
    ));
    assert_stated(&format!("| surfels in one snapshot chunk | {} |", limits::SNAPSHOT_CHUNK_SURFELS));
    assert_stated(&format!("| notes in a session | {} |", limits::ANNOTATIONS_MAX));
    assert_stated(&format!("| characters of a note | {} |", limits::ANNOTATION_TEXT_MAX_CHARS));
    assert_stated(&format!("| characters of its author | {} |", limits::ANNOTATION_AUTHOR_MAX_CHARS));
    assert_stated(&format!("| headsets with an anchor | {} |", limits::HEADSETS_MAX));
    let scales = limits::PLACEMENT_SCALES;
    assert_stated(&format!("| scale of a placement | {} to {} |", scales.start(), scales.end()));
    let (sides, openings) = (limits::PICTURE_SIDES_PX, limits::PICTURE_OPENINGS_DEG);
    assert_stated(&format!("| columns and rows of a picture | {} to {} |", sides.start(), sides.end()));
    let stated = format!("| opening of a picture, degrees | {} to {} |", openings.start(), openings.end());
    assert_stated(&stated);
    assert_stated(&format!("| time to say hello, ms | {} |", limits::HELLO_TIMEOUT_MS));
    assert_stated(&format!("| protocol version | {} |", limits::NEWEST_VERSION));
}

#[test]
fn every_close_code_is_explained() {
    for code in
        [limits::CLOSE_GOING_AWAY, limits::CLOSE_MALFORMED, limits::CLOSE_REFUSED, limits::CLOSE_OVERSIZED]
    {
        assert_stated(&format!("| {code} |"));
    }
}

#[test]
fn every_reason_and_status_is_explained() {
    let reasons = (1..).map_while(|code| Reason::try_from(code).ok()).map(Reason::name);
    let statuses = (1..).map_while(|code| SessionStatus::try_from(code).ok()).map(SessionStatus::name);
    for name in reasons.chain(statuses) {
        assert_stated(&format!("| `{name}` |"));
    }
}

#[test]
fn the_digest_examples_are_those_of_the_code() {
    for (id, version) in [(1, 1), (2, 1), (0xFFFF_FFFF, 7)] {
        assert_stated(&format!("| {id} | {version} | {:#010x} |", surfel_digest(id, version)));
    }
    for (id, place) in [(1, [0, 0, 0]), (2, [100, -200, 300])] {
        let [x, y, z] = place;
        let hash = node_digest(id, NodePosition(place));
        assert_stated(&format!("| {id} | {x}, {y}, {z} | {hash:#010x} |"));
    }
}

#[test]
fn a_snapshot_chunk_fits_one_zenoh_batch() {
    let (id_bytes_max, age_bytes_max) = (5, 3);
    let bytes_per_surfel = id_bytes_max + age_bytes_max + protocol::RECORD_BYTES;
    assert!(limits::SNAPSHOT_CHUNK_SURFELS * bytes_per_surfel + 1024 < 65_535);
}
