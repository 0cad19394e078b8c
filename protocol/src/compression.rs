//! Zstandard around whole messages of the model lane, where it pays.

use prost::Message;
use prost::bytes::Bytes;

use crate::ProtocolError;
use crate::limits::MAX_MESSAGE_BYTES;
use crate::v1::{Compressed, FromServer, from_server};

/// Fast, and close to what higher levels reach on these messages.
const LEVEL: i32 = 1;

/// The message, or a [`Compressed`] one around it where that is shorter by a sixteenth at least.
pub(crate) fn compressed_where_it_pays(plain: Vec<u8>) -> Bytes {
    let Ok(zstd) = zstd::bulk::compress(&plain, LEVEL) else { return plain.into() };
    if zstd.len() >= plain.len() - plain.len() / 16 {
        return plain.into();
    }
    let compressed = Compressed { size_bytes: plain.len() as u32, zstd: zstd.into() };
    FromServer { body: Some(from_server::Body::Compressed(compressed)) }.encode_to_vec().into()
}

/// The message within.
///
/// # Errors
/// A size over [`MAX_MESSAGE_BYTES`] before anything is allocated, bytes that are no Zstandard frame of that size, or
/// a compressed message within a compressed message.
pub(crate) fn decompressed(message: &Compressed) -> Result<FromServer, ProtocolError> {
    let size = message.size_bytes as usize;
    if size > MAX_MESSAGE_BYTES {
        return Err(ProtocolError::Oversized { bytes: size, limit: MAX_MESSAGE_BYTES });
    }
    let broken = |reason: String| ProtocolError::Compressed { size_bytes: message.size_bytes, reason };
    let plain = zstd::bulk::decompress(&message.zstd, size).map_err(|error| broken(error.to_string()))?;
    if plain.len() != size {
        return Err(broken(format!("holds {} bytes", plain.len())));
    }
    let inner = FromServer::decode(Bytes::from(plain))
        .map_err(|source| ProtocolError::Malformed { message: "FromServer", source })?;
    match inner.body {
        Some(from_server::Body::Compressed(_)) => Err(broken("holds a compressed message".to_owned())),
        _ => Ok(inner),
    }
}
