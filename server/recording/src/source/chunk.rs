//! Chunks read by the index. The library's indexed reader does not look at their checksums, so it is done here.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, Summary};

/// The chunks of one file, one of them in memory.
pub(crate) struct Chunks {
    file: File,
    /// Where each chunk's record starts and how long it is, by where its data start.
    records: BTreeMap<u64, (u64, u64)>,
    record_limit: usize,
    record: Vec<u8>,
}

impl Chunks {
    /// The chunks that a summary lists.
    pub fn new(file: File, summary: Option<&Summary>, record_limit: usize) -> Self {
        let indexes = summary.into_iter().flat_map(|summary| &summary.chunk_indexes);
        let records = indexes.filter_map(|index| {
            let data = index.compressed_data_offset().ok()?;
            Some((data, (index.chunk_start_offset, index.chunk_length)))
        });
        Self { file, records: records.collect(), record_limit, record: Vec::new() }
    }

    /// The compressed data that start at `offset`, once their checksum has been found right.
    pub fn read(&mut self, offset: u64) -> Result<&[u8], McapError> {
        let &(start, length) = self.records.get(&offset).ok_or(McapError::UnexpectedChunkDataInserted)?;
        let before = usize::try_from(offset - start).map_err(|_| McapError::ChunkTooLarge(length))?;
        self.file.seek(SeekFrom::Start(start))?;
        self.record.clear();
        // Grows as bytes come, so that a false length allocates nothing.
        let read = self.file.by_ref().take(length).read_to_end(&mut self.record)?;
        if (read as u64) < length {
            return Err(McapError::UnexpectedEof);
        }
        check(&self.record, self.record_limit)?;
        self.record.get(before..).ok_or(McapError::UnexpectedEoc)
    }
}

/// Walks through one chunk as a reader without an index would, which compares the checksum.
fn check(record: &[u8], record_limit: usize) -> Result<(), McapError> {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(record_limit);
    let mut reader = LinearReader::new_with_options(options);
    let mut left = record;
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (now, later) = left.split_at(wanted.min(left.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                left = later;
            }
            LinearReadEvent::Record { .. } => {}
        }
    }
    Ok(())
}
