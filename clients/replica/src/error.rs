//! The crate's errors.

use protocol::ProtocolError;

/// Why the model held is not the server's; a snapshot mends it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReplicaError {
    /// A message that is not of the protocol, or does not fit what is held.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
    /// Another digest than the server's: an epoch was lost or wrongly applied.
    #[error("digest {got:#010x} at epoch {epoch}, the server's is {expected:#010x}")]
    Digest {
        /// Epoch of the model.
        epoch: u32,
        /// Digest of the model held.
        got: u32,
        /// Digest of the server's.
        expected: u32,
    },
    /// More epochs came while a snapshot was under way than are kept.
    #[error("{bytes} bytes of epochs came before their snapshot; {limit} are kept")]
    Overrun {
        /// Bytes that came.
        bytes: usize,
        /// Bytes kept at most.
        limit: usize,
    },
}
