//! Envelopes to and from bytes.

use prost::Message;
use prost::bytes::Bytes;

use crate::compression::{compressed_where_it_pays, decompressed};
use crate::v1::{FromServer, Reason, Refusal, ToServer, from_server, to_server};
use crate::{ProtocolError, SessionId};

/// Encodes what the server says; the bytes are shared by all who are told.
pub fn from_server(body: from_server::Body) -> Bytes {
    FromServer { body: Some(body) }.encode_to_vec().into()
}

/// As [`from_server`], compressed where that pays: for the model lane.
pub fn from_server_compressed(body: from_server::Body) -> Bytes {
    compressed_where_it_pays(FromServer { body: Some(body) }.encode_to_vec())
}

/// Encodes what a cart or viewer says; `source` names a cart where no connection does.
pub fn to_server(body: to_server::Body, source: Option<&SessionId>) -> Bytes {
    let source = source.map(|source| source.as_str().to_owned()).unwrap_or_default();
    ToServer { source, takeover_token: String::new(), body: Some(body) }.encode_to_vec().into()
}

/// As [`to_server`], of a cart that presents the session's takeover token.
pub fn to_server_taking_over(body: to_server::Body, source: &SessionId, takeover_token: &str) -> Bytes {
    let (source, takeover_token) = (source.as_str().to_owned(), takeover_token.to_owned());
    ToServer { source, takeover_token, body: Some(body) }.encode_to_vec().into()
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

/// Decodes what the server said; a compressed message becomes the one within.
///
/// # Errors
/// [`ProtocolError::Malformed`], [`ProtocolError::Compressed`], [`ProtocolError::Oversized`].
pub fn decode_from_server(bytes: Bytes) -> Result<FromServer, ProtocolError> {
    let message = FromServer::decode(bytes)
        .map_err(|source| ProtocolError::Malformed { message: "FromServer", source })?;
    match &message.body {
        Some(from_server::Body::Compressed(compressed)) => decompressed(compressed),
        _ => Ok(message),
    }
}

/// A refusal of a whole stream, or of the pair with this sequence number.
pub fn refusal(reason: Reason, text: impl Into<String>, sequence: Option<u64>) -> Refusal {
    Refusal { reason: reason.into(), text: text.into(), sequence }
}
