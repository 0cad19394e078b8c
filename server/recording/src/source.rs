//! The records of an MCAP file, read one at a time.
//!
//! A whole, chunked file is read through its index in the order of log times, and only those chunks that hold a
//! wanted topic, each once its checksum is known to be right; any other (cut short, not chunked, without an index) from its start, up to its last good record.

mod chunk;
mod walk;

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use mcap::sans_io::indexed_reader::ReadOrder;
use mcap::sans_io::{
    IndexedReadEvent, IndexedReader, IndexedReaderOptions, LinearReaderOptions, SummaryReadEvent,
    SummaryReader, SummaryReaderOptions,
};
use mcap::{Channel, McapError, Summary};

use crate::RecordingError;

pub(crate) use walk::{Metadata, attachment, metadata};

/// One message as it lies in the file.
pub(crate) struct RawMessage {
    pub channel: Arc<Channel<'static>>,
    pub log_time_ns: u64,
    pub data: Vec<u8>,
}

/// A recording's file: where it is, how long, and what its end says about it.
#[derive(Clone)]
pub(crate) struct McapFile {
    pub path: PathBuf,
    pub bytes: u64,
    pub record_limit: usize,
    pub state: FileState,
    /// The first damage that any reader met behind the file's start.
    damage: Arc<OnceLock<String>>,
}

/// What the end of the file says.
#[derive(Clone)]
pub(crate) enum FileState {
    /// Closed properly; with a summary unless the writer left it out.
    Whole(Option<Arc<Summary>>),
    /// Cut short or damaged at the end.
    Torn(String),
}

impl McapFile {
    pub fn open(path: &Path, record_limit: usize) -> Result<Self, RecordingError> {
        let mut file = File::open(path).map_err(RecordingError::io(path))?;
        let bytes = file.metadata().map_err(RecordingError::io(path))?.len();
        let mut magic = [0; mcap::MAGIC.len()];
        let start = file.read_exact(&mut magic);
        if start.is_err() || magic != mcap::MAGIC {
            return Err(RecordingError::container(path)(McapError::BadMagic));
        }
        let state = match read_summary(&mut file, bytes, record_limit) {
            Ok(summary) => FileState::Whole(summary.map(Arc::new)),
            Err(McapError::Io(error)) if error.raw_os_error().is_some() => {
                return Err(RecordingError::io(path)(error));
            }
            Err(error) => FileState::Torn(error.to_string()),
        };
        let damage = Arc::default();
        Ok(Self { path: path.to_path_buf(), bytes, record_limit, state, damage })
    }

    pub fn summary(&self) -> Option<&Summary> {
        match &self.state {
            FileState::Whole(summary) => summary.as_deref(),
            FileState::Torn(_) => None,
        }
    }

    /// When the last chunk with a topic ends, where the index tells.
    pub fn last_ns(&self, topic: &str) -> Option<u64> {
        let summary = self.summary()?;
        let of_topic = |id: &u16| summary.channels.get(id).is_some_and(|channel| channel.topic == topic);
        let chunks = summary.chunk_indexes.iter();
        let with_topic = chunks.filter(|chunk| chunk.message_index_offsets.keys().any(of_topic));
        with_topic.map(|chunk| chunk.message_end_time).max()
    }

    /// What is wrong with the file, as far as it has been read.
    pub fn damage(&self) -> Option<&str> {
        match &self.state {
            FileState::Torn(problem) => Some(problem),
            FileState::Whole(_) => self.damage.get().map(String::as_str),
        }
    }

    /// The messages on `topics`, and nothing else.
    pub fn messages(&self, topics: &[&str]) -> Result<Messages, RecordingError> {
        self.messages_from(topics, 0)
    }

    /// As [`Self::messages`], those logged at a time or later.
    pub fn messages_from(&self, topics: &[&str], from_ns: u64) -> Result<Messages, RecordingError> {
        let file = File::open(&self.path).map_err(RecordingError::io(&self.path))?;
        let topics: Vec<String> = topics.iter().map(|&topic| topic.to_owned()).collect();
        let source = match self.indexed(&topics, from_ns)? {
            Some(Index::Nothing) => Source::Ended,
            Some(Index::Chunks(reader, channels)) => {
                let chunks = chunk::Chunks::new(file, self.summary(), self.record_limit);
                Source::Indexed { chunks, reader, channels }
            }
            None => Source::Linear(Box::new(mcap::io::MessageReader::new_with_options(
                BufReader::new(file),
                LinearReaderOptions::default()
                    .with_validate_chunk_crcs(true)
                    .with_record_length_limit(self.record_limit.min(clamp(self.bytes))),
            ))),
        };
        let damage = Arc::clone(&self.damage);
        Ok(Messages { path: self.path.clone(), topics, from_ns, source, damage })
    }

    /// A reader by the index; `None` where there is no index to trust.
    fn indexed(&self, topics: &[String], from_ns: u64) -> Result<Option<Index>, RecordingError> {
        let Some(summary) = self.summary() else { return Ok(None) };
        let chunks_are_indexed = !summary.chunk_indexes.is_empty()
            && summary.stats.as_ref().is_some_and(|s| s.chunk_count as usize == summary.chunk_indexes.len());
        if !chunks_are_indexed || summary.channels.is_empty() {
            return Ok(None);
        }
        // The reader takes an empty filter for "everything".
        if !summary.channels.values().any(|channel| topics.contains(&channel.topic)) {
            return Ok(Some(Index::Nothing));
        }
        let mut options = IndexedReaderOptions::new()
            .with_order(ReadOrder::LogTime)
            .starting_at(from_ns)
            .include_topics(topics);
        options.record_length_limit = Some(self.record_limit);
        let reader = IndexedReader::new_with_options(summary, options)
            .map_err(RecordingError::container(&self.path))?;
        let channels = summary.channels.values().map(|channel| (channel.id, Arc::clone(channel))).collect();
        Ok(Some(Index::Chunks(Box::new(reader), channels)))
    }
}

enum Index {
    Nothing,
    Chunks(Box<IndexedReader>, Channels),
}

type Channels = std::collections::BTreeMap<u16, Arc<Channel<'static>>>;

/// An iterator over messages; it ends at the first damage, which [`McapFile::damage`] then tells.
pub(crate) struct Messages {
    path: PathBuf,
    topics: Vec<String>,
    from_ns: u64,
    source: Source,
    damage: Arc<OnceLock<String>>,
}

enum Source {
    Indexed { chunks: chunk::Chunks, reader: Box<IndexedReader>, channels: Channels },
    Linear(Box<mcap::io::MessageReader<BufReader<File>>>),
    Ended,
}

impl Iterator for Messages {
    /// Only what the operating system refuses is an error.
    type Item = Result<RawMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let message = match &mut self.source {
                Source::Indexed { chunks, reader, channels } => {
                    next_indexed(chunks, reader, channels).transpose()
                }
                Source::Linear(reader) => next_linear(reader),
                Source::Ended => None,
            };
            match message {
                Some(Ok(message)) if self.wants(&message) => return Some(Ok(message)),
                Some(Ok(_)) => {}
                Some(Err(error)) => return self.stop(error),
                None => return None,
            }
        }
    }
}

impl Messages {
    fn wants(&self, message: &RawMessage) -> bool {
        message.log_time_ns >= self.from_ns && self.topics.contains(&message.channel.topic)
    }

    fn stop(&mut self, error: McapError) -> Option<Result<RawMessage, RecordingError>> {
        self.source = Source::Ended;
        match error {
            McapError::Io(error) if error.raw_os_error().is_some() => {
                Some(Err(RecordingError::io(&self.path)(error)))
            }
            damage => {
                self.damage.get_or_init(|| damage.to_string());
                None
            }
        }
    }
}

fn next_linear(
    reader: &mut mcap::io::MessageReader<BufReader<File>>,
) -> Option<Result<RawMessage, McapError>> {
    let message = reader.next()?;
    Some(message.map(|message| RawMessage {
        channel: message.channel,
        log_time_ns: message.log_time,
        data: message.data.into_owned(),
    }))
}

fn next_indexed(
    chunks: &mut chunk::Chunks,
    reader: &mut IndexedReader,
    channels: &Channels,
) -> Result<Option<RawMessage>, McapError> {
    loop {
        let Some(event) = reader.next_event() else { return Ok(None) };
        match event? {
            IndexedReadEvent::ReadChunkRequest { offset, .. } => {
                reader.insert_chunk_record_data(offset, chunks.read(offset)?)?;
            }
            IndexedReadEvent::Message { header, data } => {
                let Some(channel) = channels.get(&header.channel_id) else {
                    return Err(McapError::UnknownChannel(header.sequence, header.channel_id));
                };
                return Ok(Some(RawMessage {
                    channel: Arc::clone(channel),
                    log_time_ns: header.log_time,
                    data: data.to_vec(),
                }));
            }
        }
    }
}

fn read_summary(file: &mut File, bytes: u64, record_limit: usize) -> Result<Option<Summary>, McapError> {
    let options =
        SummaryReaderOptions::default().with_file_size(bytes).with_record_length_limit(record_limit);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(length) => {
                let read = file.read(reader.insert(length))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => {
                let position = file.seek(to)?;
                reader.notify_seeked(position);
            }
        }
    }
    Ok(reader.finish())
}

fn clamp(bytes: u64) -> usize {
    usize::try_from(bytes).unwrap_or(usize::MAX)
}
