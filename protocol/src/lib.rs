//! The wire format: protobuf messages, packed surfels, zenoh keys, HTTP routes and limits.
//!
//! `SPEC.md` describes it for people who write another client; the tests check its examples.
//! Messages hold metres, nanosecond stamps and `target_from_source` transforms. The crate does no I/O
//! and allocates nothing from a length that it has not checked.

mod digest;
mod envelope;
mod error;
pub mod keys;
pub mod limits;
mod model;
mod packed;
mod reason;
pub mod routes;
mod session_id;
mod surfel;
mod version;

/// The messages, generated from `proto/mis_slam/v1`.
#[allow(missing_docs, clippy::all, clippy::doc_markdown)]
pub mod v1 {
    include!(concat!(env!("OUT_DIR"), "/mis_slam.v1.rs"));
}

pub use digest::{Digest, surfel_digest};
pub use envelope::{decode_from_server, decode_to_server, from_server, refusal, to_server};
pub use error::ProtocolError;
pub use model::{PackedModel, SnapshotAssembly};
pub use packed::{pack_ids, pack_surfels, unpack_ids, unpack_surfels, unpack_versions};
pub use prost::bytes::Bytes;
pub use session_id::SessionId;
pub use surfel::{POSITION_STEP_M, RECORD_BYTES, SurfelRecord, WireSurfel};
pub use version::{hello, negotiate};
