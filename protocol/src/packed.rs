//! Packed arrays: ids as gaps, versions as ages, surfel records in byte planes.
//!
//! Nothing is allocated beyond what the bytes got can hold.

use prost::bytes::Bytes;

use crate::limits::MAX_SURFELS_PER_MESSAGE;
use crate::v1::PackedSurfels;
use crate::{ProtocolError, RECORD_BYTES, SurfelRecord, WireSurfel, varint};

/// Packs strictly increasing ids: of each the gap to the one before, less 1, as LEB128. The first follows on -1.
///
/// # Errors
/// [`ProtocolError::UnsortedIds`].
pub fn pack_ids(ids: &[u32]) -> Result<Bytes, ProtocolError> {
    let mut bytes = Vec::with_capacity(2 * ids.len());
    let mut next = 0_u64;
    for (index, &id) in ids.iter().enumerate() {
        let gap = u64::from(id).checked_sub(next);
        let gap = gap.ok_or_else(|| ProtocolError::UnsortedIds { index, id, previous: (next - 1) as u32 })?;
        varint::put(&mut bytes, gap as u32);
        next = u64::from(id) + 1;
    }
    Ok(bytes.into())
}

/// Reads what [`pack_ids`] wrote.
///
/// # Errors
/// [`ProtocolError::Varint`], [`ProtocolError::IdOverflow`], or over [`MAX_SURFELS_PER_MESSAGE`].
pub fn unpack_ids(field: &'static str, bytes: &[u8]) -> Result<Vec<u32>, ProtocolError> {
    let mut ids = varint::read_all(field, bytes, MAX_SURFELS_PER_MESSAGE)?;
    let mut next = 0_u64;
    for id in &mut ids {
        let absolute = next + u64::from(*id);
        *id = u32::try_from(absolute).map_err(|_| ProtocolError::IdOverflow { field })?;
        next = absolute + 1;
    }
    Ok(ids)
}

/// Packs versions as ages below `epoch`, LEB128 each.
pub(crate) fn pack_versions(versions: impl Iterator<Item = u32>, epoch: u32) -> Bytes {
    let mut bytes = Vec::new();
    versions.for_each(|version| varint::put(&mut bytes, epoch.wrapping_sub(version)));
    bytes.into()
}

/// Reads the versions that belong to `surfels` ids in a snapshot of `epoch`.
///
/// # Errors
/// [`ProtocolError::Varint`], or not as many as the ids.
pub fn unpack_versions(bytes: &[u8], epoch: u32, surfels: usize) -> Result<Vec<u32>, ProtocolError> {
    let ages = varint::read_all("versions", bytes, MAX_SURFELS_PER_MESSAGE)?;
    expect_count("versions", ages.len(), surfels)?;
    Ok(ages.into_iter().map(|age| epoch.wrapping_sub(age)).collect())
}

/// Packs surfels, which must come by increasing id.
///
/// # Errors
/// [`ProtocolError::Unpackable`] for the first surfel that has no packed form, [`ProtocolError::UnsortedIds`].
pub fn pack_surfels(surfels: &[WireSurfel]) -> Result<PackedSurfels, ProtocolError> {
    let records: Vec<SurfelRecord> = surfels.iter().map(SurfelRecord::pack).collect::<Result<_, _>>()?;
    let ids: Vec<u32> = surfels.iter().map(|surfel| surfel.id).collect();
    pack_records(&ids, &records)
}

/// Packs records that have been packed singly: all first bytes, then all second ones, and so on.
///
/// # Errors
/// [`ProtocolError::UnsortedIds`].
pub(crate) fn pack_records(ids: &[u32], records: &[SurfelRecord]) -> Result<PackedSurfels, ProtocolError> {
    let mut planes = Vec::with_capacity(records.len() * RECORD_BYTES);
    for place in 0..RECORD_BYTES {
        planes.extend(records.iter().map(|record| record.0[place]));
    }
    Ok(PackedSurfels { ids: pack_ids(ids)?, records: planes.into() })
}

/// Checks and reads ids with their records.
///
/// # Errors
/// As [`unpack_ids`], and where the records are ragged or not as many as the ids.
pub fn unpack_records(packed: &PackedSurfels) -> Result<Vec<(u32, SurfelRecord)>, ProtocolError> {
    let ids = unpack_ids("ids", &packed.ids)?;
    let planes = elements("records", &packed.records, RECORD_BYTES, ids.len())?;
    let record = |index: usize| SurfelRecord(std::array::from_fn(|place| planes[place * ids.len() + index]));
    Ok(ids.iter().enumerate().map(|(index, &id)| (id, record(index))).collect())
}

/// Checks and decodes surfels, in the order of their ids.
///
/// # Errors
/// As [`unpack_records`].
pub fn unpack_surfels(packed: &PackedSurfels) -> Result<Vec<WireSurfel>, ProtocolError> {
    Ok(unpack_records(packed)?.into_iter().map(|(id, record)| record.unpack(id)).collect())
}

/// The bytes of an array that must hold `count` elements of `element_bytes`.
///
/// # Errors
/// [`ProtocolError::RaggedArray`], [`ProtocolError::LengthMismatch`].
pub(crate) fn elements<'a>(
    field: &'static str,
    bytes: &'a [u8],
    element_bytes: usize,
    count: usize,
) -> Result<&'a [u8], ProtocolError> {
    if !bytes.len().is_multiple_of(element_bytes) {
        return Err(ProtocolError::RaggedArray { field, bytes: bytes.len(), element_bytes });
    }
    expect_count(field, bytes.len() / element_bytes, count)?;
    Ok(bytes)
}

fn expect_count(field: &'static str, got: usize, expected: usize) -> Result<(), ProtocolError> {
    if got == expected { Ok(()) } else { Err(ProtocolError::LengthMismatch { field, got, expected }) }
}
