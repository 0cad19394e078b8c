//! Envelopes to and from bytes.

use prost::Message;
use prost::bytes::Bytes;

use crate::v1::{FromServer, Reason, Refusal, ToServer, from_server, to_server};
use crate::{ProtocolError, SessionId};

/// Encodes what the server says; the bytes are shared by all who are told.
pub fn from_server(body: from_server::Body) -> Bytes {
    FromServer { body: Some(body) }.encode_to_vec().into()
}

/// Encodes what a cart or viewer says; `source` names a cart where no connection does.
pub fn to_server(body: to_server::Body, source: Option<&SessionId>) -> Bytes {
    let source = source.map(|source| source.as_str().to_owned()).unwrap_or_default();
    ToServer { source, body: Some(body) }.encode_to_vec().into()
}

/// Decodes what a cart or viewer said; image bytes are shared, not copied.
///
/// # Errors
/// [`ProtocolError::Oversized`] before anything is decoded, [`ProtocolError::Malformed`].
pub fn decode_to_server(bytes: Bytes, limit_bytes: usize) -> Result<ToServer, ProtocolError> {
    if bytes.len() > limit_bytes {
        return Err(ProtocolError::Oversized { bytes: bytes.len(), limit: limit_bytes });
    }
    ToServer::decode(bytes).map_err(|source| ProtocolError::Malformed { message: "ToServer", source })
}

/// Decodes what the server said.
///
/// # Errors
/// [`ProtocolError::Malformed`].
pub fn decode_from_server(bytes: Bytes) -> Result<FromServer, ProtocolError> {
    FromServer::decode(bytes).map_err(|source| ProtocolError::Malformed { message: "FromServer", source })
}

/// A refusal of a whole stream, or of the pair with this sequence number.
pub fn refusal(reason: Reason, text: impl Into<String>, sequence: Option<u64>) -> Refusal {
    Refusal { reason: reason.into(), text: text.into(), sequence }
}
