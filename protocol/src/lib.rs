//! The wire format: protobuf messages, packed surfels, zenoh keys, HTTP routes and limits.
//!
//! `SPEC.md` describes it for people who write another client; the tests check its examples.
//! Messages hold metres, nanosecond stamps and `target_from_source` transforms. The crate does no I/O
//! and allocates nothing from a length that it has not checked.

mod compression;
mod digest;
mod endpoint;
mod envelope;
mod epoch;
mod error;
pub mod keys;
pub mod limits;
mod model;
mod node;
mod packed;
mod reason;
pub mod routes;
mod session_id;
mod snapshot;
mod surfel;
mod table;
mod varint;
mod version;

/// The messages, generated from `proto/mis_slam/v1`.
#[allow(missing_docs, clippy::all, clippy::doc_markdown)]
pub mod v1 {
    include!(concat!(env!("OUT_DIR"), "/mis_slam.v1.rs"));
}

pub use digest::{Digest, node_digest, surfel_digest};
pub use endpoint::{Endpoint, EndpointError};
pub use envelope::{
    decode_from_server, decode_to_server, from_server, from_server_compressed, refusal, to_server,
    to_server_taking_over,
};
pub use epoch::EpochChanges;
pub use error::ProtocolError;
pub use model::PackedModel;
pub use node::{
    AFFINE_STEP, NODE_STEP_M, NodePosition, NodeTable, NodeTransform, TRANSFORM_COMPONENTS, pack_nodes,
    pack_transforms, unpack_nodes, unpack_transforms,
};
pub use packed::{pack_ids, pack_surfels, unpack_ids, unpack_records, unpack_surfels, unpack_versions};
pub use prost::bytes::Bytes;
pub use session_id::SessionId;
pub use snapshot::{ChunkContents, PlacedChunk};
pub use surfel::{MAX_POSITION_M, POSITION_STEP_M, RECORD_BYTES, SurfelRecord, WireSurfel};
pub use table::{SurfelTable, TableChanges};
pub use version::{hello, negotiate};
