//! Attachments and metadata: the file is walked from record to record, skipping their contents.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use mcap::records::{Record, op};

use super::McapFile;
use crate::RecordingError;

const RECORD_HEADER_BYTES: u64 = 9;

/// Named groups of keys and values.
pub(crate) type Metadata = BTreeMap<String, BTreeMap<String, String>>;

/// The bytes of the first attachment of that name.
pub(crate) fn attachment(file: &McapFile, name: &str) -> Result<Option<Vec<u8>>, RecordingError> {
    let mut walk = Walk::new(file)?;
    while let Some(body) = walk.next_of(op::ATTACHMENT)? {
        let record =
            mcap::parse_record(op::ATTACHMENT, &body).map_err(RecordingError::container(&file.path))?;
        if let Record::Attachment { header, data, .. } = record
            && header.name == name
        {
            return Ok(Some(data.into_owned()));
        }
    }
    Ok(None)
}

/// All metadata; of several groups with one name the last counts.
pub(crate) fn metadata(file: &McapFile) -> Result<Metadata, RecordingError> {
    let mut walk = Walk::new(file)?;
    let mut groups = Metadata::new();
    while let Some(body) = walk.next_of(op::METADATA)? {
        let record =
            mcap::parse_record(op::METADATA, &body).map_err(RecordingError::container(&file.path))?;
        if let Record::Metadata(group) = record {
            groups.insert(group.name, group.metadata);
        }
    }
    Ok(groups)
}

struct Walk<'a> {
    file: &'a McapFile,
    source: BufReader<File>,
    position: u64,
}

impl<'a> Walk<'a> {
    fn new(file: &'a McapFile) -> Result<Self, RecordingError> {
        let mut source = BufReader::new(File::open(&file.path).map_err(RecordingError::io(&file.path))?);
        let position = mcap::MAGIC.len() as u64;
        source.seek(SeekFrom::Start(position)).map_err(RecordingError::io(&file.path))?;
        Ok(Self { file, source, position })
    }

    /// The body of the next record of a kind; `None` at the end of the data, or where the file is cut short.
    fn next_of(&mut self, wanted: u8) -> Result<Option<Vec<u8>>, RecordingError> {
        let refused = RecordingError::io(&self.file.path);
        self.walk_to(wanted).map_err(refused)
    }

    fn walk_to(&mut self, wanted: u8) -> std::io::Result<Option<Vec<u8>>> {
        loop {
            let left = self.file.bytes.saturating_sub(self.position + RECORD_HEADER_BYTES);
            if left == 0 {
                return Ok(None);
            }
            let mut header = [0; RECORD_HEADER_BYTES as usize];
            self.source.read_exact(&mut header)?;
            let [opcode, length @ ..] = header;
            let length = u64::from_le_bytes(length);
            if length > left || opcode == op::DATA_END {
                return Ok(None);
            }
            self.position += RECORD_HEADER_BYTES + length;
            if opcode == wanted {
                let mut body = Vec::new();
                self.source.by_ref().take(length).read_to_end(&mut body)?;
                return Ok(Some(body));
            }
            // At most the file's length, which fits.
            self.source.seek_relative(length as i64)?;
        }
    }
}
