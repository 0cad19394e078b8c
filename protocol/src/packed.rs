//! Packed arrays: ids, versions and surfel records side by side.
//!
//! Nothing is allocated before all lengths agree with each other and with the limit.

use prost::bytes::Bytes;

use crate::limits::MAX_SURFELS_PER_MESSAGE;
use crate::v1::PackedSurfels;
use crate::{ProtocolError, RECORD_BYTES, SurfelRecord, WireSurfel};

const ID_BYTES: usize = 4;

/// Packs ids (or versions) as u32 little-endian.
pub fn pack_ids(ids: &[u32]) -> Bytes {
    ids.iter().flat_map(|id| id.to_le_bytes()).collect()
}

/// Packs surfels in the order given.
///
/// # Errors
/// [`ProtocolError::Unpackable`] for the first surfel that has no packed form.
pub fn pack_surfels(surfels: &[WireSurfel]) -> Result<PackedSurfels, ProtocolError> {
    let mut records = Vec::with_capacity(surfels.len() * RECORD_BYTES);
    for surfel in surfels {
        records.extend_from_slice(&SurfelRecord::pack(surfel)?.0);
    }
    let ids: Vec<u32> = surfels.iter().map(|surfel| surfel.id).collect();
    Ok(PackedSurfels { ids: pack_ids(&ids), records: records.into() })
}

/// Checks and reads an array of strictly increasing ids.
///
/// # Errors
/// Ragged, unsorted, or over [`MAX_SURFELS_PER_MESSAGE`].
pub fn unpack_ids(field: &'static str, bytes: &[u8]) -> Result<Vec<u32>, ProtocolError> {
    let ids = unpack_numbers(field, bytes)?;
    let unsorted = ids.windows(2).position(|pair| pair[0] >= pair[1]);
    match unsorted {
        Some(index) => {
            Err(ProtocolError::UnsortedIds { index: index + 1, id: ids[index + 1], previous: ids[index] })
        }
        None => Ok(ids),
    }
}

/// Checks and reads the versions that belong to `surfels` ids.
///
/// # Errors
/// Ragged, or not as many as the ids.
pub fn unpack_versions(bytes: &[u8], surfels: usize) -> Result<Vec<u32>, ProtocolError> {
    let versions = unpack_numbers("versions", bytes)?;
    expect_count("versions", versions.len(), surfels)?;
    Ok(versions)
}

/// Checks and reads ids and records; both have the same length.
///
/// # Errors
/// As [`unpack_ids`], and where the records are ragged or not as many as the ids.
pub fn unpack_records(packed: &PackedSurfels) -> Result<(Vec<u32>, Vec<SurfelRecord>), ProtocolError> {
    let ids = unpack_ids("ids", &packed.ids)?;
    let (records, rest) = packed.records.as_chunks::<RECORD_BYTES>();
    if !rest.is_empty() {
        return Err(ragged("records", packed.records.len(), RECORD_BYTES));
    }
    expect_count("records", records.len(), ids.len())?;
    Ok((ids, records.iter().copied().map(SurfelRecord).collect()))
}

/// Checks and decodes surfels, in the order of their ids.
///
/// # Errors
/// As [`unpack_records`].
pub fn unpack_surfels(packed: &PackedSurfels) -> Result<Vec<WireSurfel>, ProtocolError> {
    let (ids, records) = unpack_records(packed)?;
    Ok(ids.into_iter().zip(records).map(|(id, record)| record.unpack(id)).collect())
}

fn unpack_numbers(field: &'static str, bytes: &[u8]) -> Result<Vec<u32>, ProtocolError> {
    let (numbers, rest) = bytes.as_chunks::<ID_BYTES>();
    if !rest.is_empty() {
        return Err(ragged(field, bytes.len(), ID_BYTES));
    }
    if numbers.len() > MAX_SURFELS_PER_MESSAGE {
        return Err(ProtocolError::TooManySurfels { surfels: numbers.len(), limit: MAX_SURFELS_PER_MESSAGE });
    }
    Ok(numbers.iter().map(|number| u32::from_le_bytes(*number)).collect())
}

fn expect_count(field: &'static str, got: usize, expected: usize) -> Result<(), ProtocolError> {
    if got == expected { Ok(()) } else { Err(ProtocolError::LengthMismatch { field, got, expected }) }
}

fn ragged(field: &'static str, bytes: usize, element_bytes: usize) -> ProtocolError {
    ProtocolError::RaggedArray { field, bytes, element_bytes }
}
