//! What must hold of every decoder, whatever bytes come. Run by the fuzz targets, and over their corpora by
//! `tests/corpora.rs`; each target uses one of these.
#![allow(dead_code)]

use prost::Message;
use protocol::v1::{ModelEpoch, SnapshotChunk};
use protocol::{Bytes, ChunkContents, PackedModel, SurfelRecord, keys, limits};

const LIMIT_BYTES: usize = 1 << 20;

/// Any bytes are a message or an error, and a message encodes to one that decodes to the same.
pub fn decode_from_server(bytes: &[u8]) {
    let Ok(message) = protocol::decode_from_server(Bytes::copy_from_slice(bytes)) else { return };
    let Some(body) = message.body else { return };
    for encoded in [protocol::from_server(body.clone()), protocol::from_server_compressed(body.clone())] {
        let again = protocol::decode_from_server(encoded).expect("what was decoded can be encoded");
        assert_eq!(format!("{:?}", again.body), format!("{:?}", Some(&body)), "NaN is equal to itself here");
    }
}

/// As above, for what the server receives.
pub fn decode_to_server(bytes: &[u8]) {
    let Ok(message) = protocol::decode_to_server(Bytes::copy_from_slice(bytes), LIMIT_BYTES) else { return };
    let again = protocol::decode_to_server(message.encode_to_vec().into(), usize::MAX);
    let again = again.expect("what was decoded can be encoded");
    assert_eq!(format!("{again:?}"), format!("{message:?}"));
}

/// An epoch on an empty model and a second one on what comes of it: applied as a whole or not at all.
pub fn apply_epoch(bytes: &[u8]) {
    let mut model = PackedModel::default();
    let mut rest = bytes;
    while let Some((length, tail)) = rest.split_first_chunk::<2>() {
        let (part, tail) = tail.split_at(usize::from(u16::from_le_bytes(*length)).min(tail.len()));
        rest = tail;
        let Ok(epoch) = ModelEpoch::decode(part) else { continue };
        let before = model.clone();
        match model.advance(epoch) {
            Ok(completed) => {
                assert_eq!(completed.surfels as usize, model.surfels().len());
                assert_eq!(completed.nodes as usize, model.nodes().len());
                assert!(model.surfels().ids().is_sorted() && model.nodes().ids().is_sorted());
            }
            Err(_) => assert_eq!(model, before),
        }
    }
}

/// A chunk holds as many versions as surfels, by increasing id.
pub fn unpack_chunk(bytes: &[u8]) {
    let Ok(chunk) = SnapshotChunk::decode(bytes) else { return };
    let Ok(contents) = ChunkContents::unpack(&chunk) else { return };
    assert!(contents.surfels.windows(2).all(|pair| pair[0].0 < pair[1].0));
    assert!(contents.nodes.is_none_or(|nodes| nodes.len() <= limits::MAX_NODES));
}

/// Ids, versions, transforms, and any 16 bytes as a surfel.
pub fn unpack_arrays(bytes: &[u8]) {
    if let Ok(ids) = protocol::unpack_ids("ids", bytes) {
        assert!(ids.windows(2).all(|pair| pair[0] < pair[1]));
        let packed = protocol::pack_ids(&ids).expect("increasing ids");
        assert_eq!(protocol::unpack_ids("ids", &packed), Ok(ids));
    }
    let _ = protocol::unpack_versions(bytes, 7, bytes.len());
    if let Ok(transforms) = protocol::unpack_transforms(bytes, bytes.len() / 24) {
        assert_eq!(protocol::pack_transforms(&transforms), bytes);
    }
    for record in bytes.as_chunks().0 {
        let surfel = SurfelRecord(*record).unpack(0);
        assert!(
            surfel.position_in_world_m.iter().chain(&surfel.normal_in_world).all(|value| value.is_finite())
        );
    }
}

/// A key that parses is one of ours.
pub fn parse_key(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok((session, Some(lane))) = keys::parse(text) {
        assert_eq!(lane.key(&session), text);
    }
    if let Ok((session, source)) = keys::parse_source_token(text) {
        assert_eq!(keys::source_token(&session, &source), text);
    }
}
