//! Envelopes: round trips, unknown fields, malformed bytes; calibrations as JSON.
#![expect(clippy::unwrap_used, reason = "a test ends at what it does not expect")]

use proptest::prelude::*;
use prost::Message;
use protocol::v1::{
    Calibration, Camera, Compressed, EncodedImage, FromServer, ImageFormat, ModelEpoch, Reason, RectifiedRig,
    StereoPair, ToServer, from_server, to_server,
};
use protocol::{Bytes, ProtocolError, SessionId};

const LIMIT_BYTES: usize = 1 << 20;

fn image() -> EncodedImage {
    EncodedImage {
        format: ImageFormat::Jpeg.into(),
        width_px: 640,
        height_px: 480,
        data: Bytes::from_static(&[0xFF, 0xD8, 0xFF]),
    }
}

fn pair() -> StereoPair {
    StereoPair { stamp_ns: 33_000_000, sequence: 1, left: Some(image()), right: Some(image()), mask: None }
}

#[test]
fn a_pair_survives_the_way_and_names_its_cart() {
    let cart: SessionId = "cart-1".parse().unwrap();
    let bytes = protocol::to_server(to_server::Body::Pair(pair()), Some(&cart));
    let envelope = protocol::decode_to_server(bytes, LIMIT_BYTES).unwrap();
    assert_eq!(
        envelope,
        ToServer {
            source: "cart-1".into(),
            takeover_token: String::new(),
            body: Some(to_server::Body::Pair(pair()))
        }
    );
}

#[test]
fn a_refusal_survives_the_way() {
    let refusal = protocol::refusal(Reason::StaleStamp, "stamp 1 is older than 2", Some(9));
    let bytes = protocol::from_server(from_server::Body::Refusal(refusal.clone()));
    let body = protocol::decode_from_server(bytes).unwrap().body.unwrap();
    assert_eq!(body, from_server::Body::Refusal(refusal));
    assert_eq!(Reason::StaleStamp.name(), "stale_stamp");
}

#[test]
fn a_newer_peer_may_say_more_than_this_one_understands() {
    let mut bytes = protocol::to_server(to_server::Body::Pair(pair()), None).to_vec();
    bytes.extend_from_slice(&[0xA2, 0x06, 0x02, b'h', b'i']); // field 100, two bytes
    let envelope = protocol::decode_to_server(bytes.into(), LIMIT_BYTES).unwrap();
    assert_eq!(envelope.body, Some(to_server::Body::Pair(pair())));
}

#[test]
fn oversized_bytes_are_refused_before_they_are_decoded() {
    let refused = protocol::decode_to_server(vec![0xFF; 11].into(), 10).unwrap_err();
    assert_eq!(refused, ProtocolError::Oversized { bytes: 11, limit: 10 });
}

#[test]
fn broken_bytes_are_refused() {
    let good = protocol::to_server(to_server::Body::Pair(pair()), None);
    let mut length_beyond_the_end = good.to_vec();
    length_beyond_the_end[1] = 0x7F;
    let truncated = good[..good.len() - 1].to_vec();
    let no_such_wire_type = vec![0x0F, 0x00];
    let text = b"GET / HTTP/1.1".to_vec();
    for bytes in [length_beyond_the_end, truncated, no_such_wire_type, text] {
        let refused = protocol::decode_to_server(bytes.into(), LIMIT_BYTES).unwrap_err();
        assert!(matches!(refused, ProtocolError::Malformed { message: "ToServer", .. }), "{refused}");
    }
}

#[test]
fn the_calibration_in_the_specification_is_read_from_json() {
    let spec = include_str!("../SPEC.md");
    let example = spec.split("```json\n").nth(1).unwrap().split("```").next().unwrap();
    let body: serde_json::Value = serde_json::from_str(example).unwrap();
    let calibration: Calibration = serde_json::from_value(body["calibration"].clone()).unwrap();
    let left =
        Camera { width_px: 640, height_px: 480, fx_px: 520.0, fy_px: 520.0, cx_px: 320.0, cy_px: 240.0 };
    let rig = RectifiedRig { left: Some(left), baseline_m: 0.005, right_cx_px: 320.0 };
    assert_eq!(calibration, Calibration { rectified: Some(rig), raw: None });
}

#[test]
fn an_unknown_key_in_a_json_calibration_is_refused() {
    let misspelt = r#"{"rectified": {"baseline_mm": 5.0}}"#;
    assert!(serde_json::from_str::<Calibration>(misspelt).is_err());
}

proptest! {
    #[test]
    fn no_bytes_bring_the_decoders_down(bytes in prop::collection::vec(any::<u8>(), 0..512)) {
        let _ = protocol::decode_to_server(bytes.clone().into(), LIMIT_BYTES);
        let _ = protocol::decode_from_server(bytes.into());
    }
}

fn large_epoch() -> from_server::Body {
    let removed_ids = protocol::pack_ids(&(0..5000).collect::<Vec<_>>()).unwrap();
    from_server::Body::Epoch(ModelEpoch { epoch: 2, base_epoch: 1, removed_ids, ..ModelEpoch::default() })
}

#[test]
fn a_message_that_compresses_well_travels_compressed() {
    let bytes = protocol::from_server_compressed(large_epoch());
    assert!(bytes.len() < 100, "{} bytes", bytes.len());
    assert_eq!(protocol::decode_from_server(bytes).unwrap().body, Some(large_epoch()));
}

#[test]
fn a_message_that_does_not_is_left_as_it_is() {
    let refusal = from_server::Body::Refusal(protocol::refusal(Reason::StaleStamp, "abc", None));
    assert_eq!(protocol::from_server_compressed(refusal.clone()), protocol::from_server(refusal));
}

#[test]
fn a_compressed_message_that_lies_is_refused() {
    let honest = protocol::from_server_compressed(large_epoch());
    let Some(from_server::Body::Compressed(honest)) = FromServer::decode(honest).unwrap().body else {
        panic!("not compressed")
    };
    let refused = |compressed: Compressed| {
        let bytes = protocol::from_server(from_server::Body::Compressed(compressed));
        protocol::decode_from_server(bytes).unwrap_err()
    };
    let bomb = Compressed { size_bytes: u32::MAX, ..honest.clone() };
    let limit = protocol::limits::MAX_MESSAGE_BYTES;
    assert_eq!(refused(bomb), ProtocolError::Oversized { bytes: u32::MAX as usize, limit });
    for size_bytes in [0, honest.size_bytes - 1, honest.size_bytes + 1] {
        let error = refused(Compressed { size_bytes, ..honest.clone() });
        assert!(matches!(error, ProtocolError::Compressed { .. }), "{error}");
    }
    let garbage = Compressed { zstd: Bytes::from_static(b"no frame"), ..honest.clone() };
    assert!(matches!(refused(garbage), ProtocolError::Compressed { .. }));
    let nested = protocol::from_server(from_server::Body::Compressed(honest));
    let twice = Compressed {
        size_bytes: nested.len() as u32,
        zstd: zstd::bulk::compress(&nested, 1).unwrap().into(),
    };
    assert!(refused(twice).to_string().contains("holds a compressed message"));
}
