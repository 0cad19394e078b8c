//! The crate's errors.

/// What can be wrong with bytes, ids and values of the wire format.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProtocolError {
    /// Not the protobuf message that was expected.
    #[error("not a {message}: {source}")]
    Malformed {
        /// Name of the message.
        message: &'static str,
        /// What the decoder said.
        source: prost::DecodeError,
    },
    /// More bytes than the limit.
    #[error("a message of {bytes} bytes is over the limit of {limit} bytes")]
    Oversized {
        /// Bytes got.
        bytes: usize,
        /// Bytes allowed.
        limit: usize,
    },
    /// An id that no session can have.
    #[error("session id {given:?} is not 1 to {max} characters of A-Z a-z 0-9 _ -", max = crate::limits::MAX_SESSION_ID_CHARS)]
    SessionId {
        /// The start of what was given.
        given: String,
    },
    /// A packed array that is no whole number of elements.
    #[error("{field} has {bytes} bytes, no multiple of {element_bytes}")]
    RaggedArray {
        /// Name of the array.
        field: &'static str,
        /// Bytes got.
        bytes: usize,
        /// Bytes of one element.
        element_bytes: usize,
    },
    /// Arrays that belong together and differ in length.
    #[error("{field} has {got} elements for {expected} ids")]
    LengthMismatch {
        /// Name of the array.
        field: &'static str,
        /// Elements got.
        got: usize,
        /// Ids.
        expected: usize,
    },
    /// Ids that do not strictly increase.
    #[error("id {id} at index {index} does not come after {previous}")]
    UnsortedIds {
        /// Place in the array.
        index: usize,
        /// The id there.
        id: u32,
        /// The one before.
        previous: u32,
    },
    /// A number that is cut short or longer than 32 bits.
    #[error("{field}: number {index} is no LEB128 of at most 32 bits")]
    Varint {
        /// Name of the array.
        field: &'static str,
        /// Place in the array.
        index: usize,
    },
    /// Gaps that add up to more than 32 bits.
    #[error("{field}: an id is over 32 bits")]
    IdOverflow {
        /// Name of the array.
        field: &'static str,
    },
    /// More elements than one message may hold.
    #[error("{field} has {got} elements; the limit is {limit}")]
    TooMany {
        /// Name of the array.
        field: &'static str,
        /// Elements got.
        got: usize,
        /// Elements allowed.
        limit: usize,
    },
    /// A compressed message that does not decompress to what it says.
    #[error("a compressed message of {size_bytes} bytes: {reason}")]
    Compressed {
        /// Bytes that it says it holds.
        size_bytes: u32,
        /// What is wrong.
        reason: String,
    },
    /// A value that has no packed form.
    #[error("surfel {id}: {field} is {value}")]
    Unpackable {
        /// The surfel.
        id: u32,
        /// Name of the value.
        field: &'static str,
        /// The value.
        value: f32,
    },
    /// No protocol version that both sides speak.
    #[error("the peer speaks versions {peer_oldest} to {peer_newest}, this side {oldest} to {newest}", oldest = crate::limits::OLDEST_VERSION, newest = crate::limits::NEWEST_VERSION)]
    NoCommonVersion {
        /// The peer's oldest version.
        peer_oldest: u32,
        /// The peer's newest version.
        peer_newest: u32,
    },
    /// An epoch that does not follow on the model held.
    #[error("an epoch on base {base} for a model at epoch {held}")]
    WrongBase {
        /// Epoch of the model.
        held: u32,
        /// Base of the epoch got.
        base: u32,
    },
    /// A surfel or node to be changed or removed that the model does not hold.
    #[error("{what} {id} is to be changed but not held")]
    NotHeld {
        /// Surfel or node.
        what: &'static str,
        /// Its id.
        id: u32,
    },
    /// A surfel or node to be added that the model holds already.
    #[error("{what} {id} is to be added but held already")]
    AlreadyHeld {
        /// Surfel or node.
        what: &'static str,
        /// Its id.
        id: u32,
    },
    /// The model is not the server's.
    #[error("digest {got:#010x} at epoch {epoch}, expected {expected:#010x}")]
    DigestMismatch {
        /// Epoch of the model.
        epoch: u32,
        /// Digest of the model held.
        got: u32,
        /// Digest of the server's.
        expected: u32,
    },
    /// A snapshot chunk whose index is beyond the count, or whose count differs from that of its snapshot.
    #[error("snapshot chunk {index} of {count}")]
    ChunkIndex {
        /// Index got.
        index: u32,
        /// Chunks that there are.
        count: u32,
    },
}
