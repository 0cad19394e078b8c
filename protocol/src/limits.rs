//! Versions and sizes that both sides know beforehand.

use std::ops::RangeInclusive;

/// The oldest protocol version that this crate speaks.
pub const OLDEST_VERSION: u32 = 1;
/// The newest protocol version that this crate speaks.
pub const NEWEST_VERSION: u32 = 1;

/// Characters of a session id.
pub const MAX_SESSION_ID_CHARS: usize = 64;

/// Surfels in one packed block; keeps a decoder's allocation under 64 MiB.
pub const MAX_SURFELS_PER_MESSAGE: usize = 1 << 20;

/// Deformation nodes in a model.
pub const MAX_NODES: usize = 1 << 16;

/// Bytes of a message from the server once it is decompressed.
pub const MAX_MESSAGE_BYTES: usize = 64 << 20;

/// Surfels in one snapshot chunk: under 60,000 bytes with ids and versions, so that it fits one zenoh batch of 64 KiB.
pub const SNAPSHOT_CHUNK_SURFELS: usize = 2500;

/// Notes on the tissue of one session.
pub const ANNOTATIONS_MAX: usize = 256;
/// Characters of a note.
pub const ANNOTATION_TEXT_MAX_CHARS: usize = 200;
/// Characters of the name of a note's author.
pub const ANNOTATION_AUTHOR_MAX_CHARS: usize = 40;
/// Headsets of one session whose anchors are kept.
pub const HEADSETS_MAX: usize = 64;
/// Scales in which headsets may show a model; 1 is life size.
pub const PLACEMENT_SCALES: RangeInclusive<f32> = 0.05..=50.0;

/// Columns and rows of a picture of the model.
pub const PICTURE_SIDES_PX: RangeInclusive<u32> = 16..=2048;
/// Angles by which the shorter side of a picture may open.
pub const PICTURE_OPENINGS_DEG: RangeInclusive<f64> = 1.0..=150.0;

/// Time in which a peer must say hello.
pub const HELLO_TIMEOUT_MS: u64 = 5_000;

/// WebSocket close code: the peer's message is no message of the protocol (RFC 6455: invalid payload).
pub const CLOSE_MALFORMED: u16 = 1007;
/// WebSocket close code: refused by a rule of the protocol; a refusal that says which came before (RFC 6455: policy).
pub const CLOSE_REFUSED: u16 = 1008;
/// WebSocket close code: message too big.
pub const CLOSE_OVERSIZED: u16 = 1009;
/// WebSocket close code: the server is going away.
pub const CLOSE_GOING_AWAY: u16 = 1001;
