//! [MCAP](https://mcap.dev/spec) files: schemas, channels and messages in uncompressed chunks, with checksums and indexes.

use std::collections::BTreeMap;
use std::io::{self, Write};

use crc32fast::Hasher;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// The name of this writer in the file.
const LIBRARY: &str = concat!("vocc ", env!("CARGO_PKG_VERSION"));
/// A chunk ends once it exceeds this size.
const CHUNK_BYTES: usize = 1024 * 1024;

/// Overhead of a message: the fields before it, and its place in the index.
const MESSAGE_BYTES: usize = 31 + 16;
/// Overhead of a chunk: its record, and its place in the summary.
const CHUNK_RECORD_BYTES: usize = 49 + 73;
/// Overhead of each channel in a chunk: an index record, and its place in the summary.
const CHUNK_CHANNEL_BYTES: usize = 15 + 10;
/// The end of the data, the statistics without their channels, the offsets of four groups, the footer, and the magic.
const SUMMARY_BYTES: usize = 13 + 55 + 4 * 26 + 29 + 8;

/// Opcodes of the record types.
mod op {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const STATISTICS: u8 = 0x0b;
    pub const SUMMARY_OFFSET: u8 = 0x0e;
    pub const DATA_END: u8 = 0x0f;
}

/// A message type as defined in ROS 2.
pub struct Schema {
    pub name: &'static str,
    pub definition: &'static str,
}

/// Writes a file sequentially.
pub struct Writer<W> {
    file: W,
    position: u64,
    checksum: Hasher,
    chunk: Chunk,
    /// The names of the schemas, with their records.
    schemas: Vec<(&'static str, Vec<u8>)>,
    /// The records of schemas and channels, in their order.
    definitions: Vec<u8>,
    /// The records of the channels, with their message counts.
    channels: Vec<(Vec<u8>, u64)>,
    chunk_indexes: Vec<Vec<u8>>,
    times_ns: Option<[u64; 2]>,
}

/// Buffered records.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    times_ns: Option<[u64; 2]>,
    /// The time and the offset of each message, by channel.
    indexes: BTreeMap<u16, Vec<u8>>,
}

impl<W: Write> Writer<W> {
    /// Begins a file of ROS 2 messages.
    pub fn new(file: W) -> io::Result<Self> {
        let mut writer = Self {
            file,
            position: 0,
            checksum: Hasher::new(),
            chunk: Chunk::default(),
            schemas: Vec::new(),
            definitions: Vec::new(),
            channels: Vec::new(),
            chunk_indexes: Vec::new(),
            times_ns: None,
        };
        writer.put(MAGIC)?;
        writer.put(&record(op::HEADER, &[&text("ros2"), &text(LIBRARY)]))?;
        Ok(writer)
    }

    /// Begins the next file of the same schemas and channels.
    pub fn next(&self, file: W) -> io::Result<Self> {
        let mut next = Self::new(file)?;
        next.schemas.clone_from(&self.schemas);
        next.channels = self.channels.iter().map(|(record, _)| (record.clone(), 0)).collect();
        next.definitions.clone_from(&self.definitions);
        next.chunk.records.clone_from(&self.definitions);
        Ok(next)
    }

    /// Upper bound on the size of the finished file with further messages of these lengths.
    pub fn finished_bytes(&self, lengths: impl Iterator<Item = usize>) -> u64 {
        let channels = self.channels.len();
        let indexed = self.chunk.indexes.values().map(Vec::len).sum::<usize>();
        let new: usize = lengths.map(|length| MESSAGE_BYTES + length).sum();
        let records = self.chunk.records.len() + indexed + new;
        let chunks = 1 + records / CHUNK_BYTES;
        let chunk_indexes: usize = self.chunk_indexes.iter().map(Vec::len).sum();
        let summary = self.definitions.len() + chunk_indexes + SUMMARY_BYTES + 10 * channels;
        self.position + (records + chunks * (CHUNK_RECORD_BYTES + CHUNK_CHANNEL_BYTES * channels) + summary) as u64
    }

    /// Adds a channel, and returns its id.
    pub fn channel(&mut self, topic: &str, schema: Schema) -> u16 {
        let known = self.schemas.iter().position(|(name, _)| *name == schema.name);
        let index = known.unwrap_or(self.schemas.len());
        let schema_id = (index as u16 + 1).to_le_bytes();
        if known.is_none() {
            let definition = text(schema.definition);
            let record = record(op::SCHEMA, &[&schema_id, &text(schema.name), &text("ros2msg"), &definition]);
            self.chunk.records.extend_from_slice(&record);
            self.definitions.extend_from_slice(&record);
            self.schemas.push((schema.name, record));
        }
        let id = self.channels.len() as u16 + 1;
        let no_metadata = 0_u32.to_le_bytes();
        let record = record(
            op::CHANNEL,
            &[&id.to_le_bytes(), &schema_id, &text(topic), &text("cdr"), &no_metadata],
        );
        self.chunk.records.extend_from_slice(&record);
        self.definitions.extend_from_slice(&record);
        self.channels.push((record, 0));
        id
    }

    /// Adds a message to a channel of this file.
    pub fn message(&mut self, channel: u16, time_ns: u64, message: &[u8]) -> io::Result<()> {
        if self.chunk.records.len() > CHUNK_BYTES {
            self.end_chunk()?;
        }
        let Some((_, count)) = self.channels.get_mut(usize::from(channel.wrapping_sub(1))) else {
            return Err(io::Error::other("the recording has no such channel"));
        };
        let (id, sequence, time) = (channel.to_le_bytes(), (*count as u32).to_le_bytes(), time_ns.to_le_bytes());
        *count += 1;
        let chunk = &mut self.chunk;
        let offset = (chunk.records.len() as u64).to_le_bytes();
        chunk.indexes.entry(channel).or_default().extend([time, offset].concat());
        for times_ns in [&mut chunk.times_ns, &mut self.times_ns] {
            let [first, last] = times_ns.unwrap_or([time_ns; 2]);
            *times_ns = Some([first.min(time_ns), last.max(time_ns)]);
        }
        // Log time and publish time are equal.
        chunk
            .records
            .extend_from_slice(&record(op::MESSAGE, &[&id, &sequence, &time, &time, message]));
        Ok(())
    }

    /// Ends the current chunk, so that all messages are readable.
    pub fn keep(&mut self) -> io::Result<()> {
        self.end_chunk()?;
        self.file.flush()
    }

    /// Writes the remaining chunk and the summary.
    pub fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        let checksum = self.checksum.clone().finalize().to_le_bytes();
        self.put(&record(op::DATA_END, &[&checksum]))?;
        let start = self.position;
        let schemas: Vec<u8> = self.schemas.iter().flat_map(|(_, record)| record).copied().collect();
        let channels: Vec<u8> = self.channels.iter().flat_map(|(record, _)| record).copied().collect();
        let groups = [
            (op::SCHEMA, schemas),
            (op::CHANNEL, channels),
            (op::STATISTICS, self.statistics()),
            (op::CHUNK_INDEX, self.chunk_indexes.concat()),
        ];
        let (mut summary, mut offsets) = (Vec::new(), Vec::new());
        for (code, records) in groups.iter().filter(|(_, records)| !records.is_empty()) {
            let group_start = (start + summary.len() as u64).to_le_bytes();
            let length = (records.len() as u64).to_le_bytes();
            offsets.extend(record(op::SUMMARY_OFFSET, &[&[*code], &group_start, &length]));
            summary.extend_from_slice(records);
        }
        let offsets_start = start + summary.len() as u64;
        summary.extend(offsets);
        // The footer's checksum covers the summary and the footer's preceding fields.
        let mut footer = record(op::FOOTER, &[&start.to_le_bytes(), &offsets_start.to_le_bytes(), &[0; 4]]);
        footer.truncate(footer.len() - 4);
        summary.extend(footer);
        let checksum = crc32fast::hash(&summary).to_le_bytes();
        self.put(&summary)?;
        self.put(&checksum)?;
        self.put(MAGIC)?;
        self.file.flush()?;
        Ok(self.file)
    }

    fn statistics(&self) -> Vec<u8> {
        let used = (1_u16..).zip(&self.channels).filter(|(_, (_, count))| *count > 0);
        let counts: Vec<u8> = used
            .flat_map(|(id, (_, count))| id.to_le_bytes().into_iter().chain(count.to_le_bytes()))
            .collect();
        let messages: u64 = self.channels.iter().map(|(_, count)| count).sum();
        let [first, last] = self.times_ns.unwrap_or_default().map(u64::to_le_bytes);
        record(
            op::STATISTICS,
            &[
                &messages.to_le_bytes(),
                &(self.schemas.len() as u16).to_le_bytes(),
                &(self.channels.len() as u32).to_le_bytes(),
                // No attachments or metadata.
                &[0; 8],
                &(self.chunk_indexes.len() as u32).to_le_bytes(),
                &first,
                &last,
                &sized(&counts),
            ],
        )
    }

    /// Writes the current chunk, unless empty, and its message indexes.
    fn end_chunk(&mut self) -> io::Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        if chunk.records.is_empty() {
            return Ok(());
        }
        let [first, last] = chunk.times_ns.unwrap_or_default().map(u64::to_le_bytes);
        let size = (chunk.records.len() as u64).to_le_bytes();
        let checksum = crc32fast::hash(&chunk.records).to_le_bytes();
        let compression = text("");
        let start = self.position;
        self.put(&record(
            op::CHUNK,
            &[&first, &last, &size, &checksum, &compression, &size, &chunk.records],
        ))?;
        let end = self.position;
        let mut offsets = Vec::new();
        for (channel, index) in chunk.indexes {
            let id = channel.to_le_bytes();
            offsets.extend_from_slice(&id);
            offsets.extend_from_slice(&self.position.to_le_bytes());
            self.put(&record(op::MESSAGE_INDEX, &[&id, &sized(&index)]))?;
        }
        self.chunk_indexes.push(record(
            op::CHUNK_INDEX,
            &[
                &first,
                &last,
                &start.to_le_bytes(),
                &(end - start).to_le_bytes(),
                &sized(&offsets),
                &(self.position - end).to_le_bytes(),
                &compression,
                &size,
                &size,
            ],
        ));
        Ok(())
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.position += bytes.len() as u64;
        self.checksum.update(bytes);
        Ok(())
    }
}

/// Concatenates fields to a record.
fn record(code: u8, fields: &[&[u8]]) -> Vec<u8> {
    let length: usize = fields.iter().map(|field| field.len()).sum();
    let mut record = Vec::with_capacity(9 + length);
    record.push(code);
    record.extend_from_slice(&(length as u64).to_le_bytes());
    for field in fields {
        record.extend_from_slice(field);
    }
    record
}

/// Bytes with a length prefix.
fn sized(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn text(text: &str) -> Vec<u8> {
    sized(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// The format's reference library, for the same messages.
    fn reference(channels: &[(&str, Schema)], messages: &[(u16, u64, Vec<u8>)]) -> Vec<u8> {
        let options = mcap::WriteOptions::new().profile("ros2").library(LIBRARY).compression(None);
        let mut writer = options.create(Cursor::new(Vec::new())).expect("a file");
        for (topic, schema) in channels {
            let schema = writer
                .add_schema(schema.name, "ros2msg", schema.definition.as_bytes())
                .expect("a schema");
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("a channel");
        }
        let mut counts = BTreeMap::<u16, u32>::new();
        for (channel_id, time_ns, data) in messages {
            let count = counts.entry(*channel_id).or_default();
            let header = mcap::records::MessageHeader {
                channel_id: *channel_id,
                sequence: *count,
                log_time: *time_ns,
                publish_time: *time_ns,
            };
            *count += 1;
            writer.write_to_known_channel(&header, data).expect("a message");
        }
        writer.finish().expect("a file");
        writer.into_inner().into_inner()
    }

    fn channels() -> [(&'static str, Schema); 3] {
        let schema = |name, definition| Schema { name, definition };
        [
            ("/image", schema("a/msg/Image", "uint8[] data\n")),
            ("/panel_0", schema("a/msg/String", "string data\n")),
            ("/panel_1", schema("a/msg/String", "string data\n")),
        ]
    }

    fn written(messages: &[(u16, u64, Vec<u8>)]) -> Vec<u8> {
        let mut writer = Writer::new(Vec::new()).expect("a file");
        let ids = channels().map(|(topic, schema)| writer.channel(topic, schema));
        assert_eq!(ids, [1, 2, 3]);
        for (channel, time_ns, message) in messages {
            writer.message(*channel, *time_ns, message).expect("a message");
        }
        writer.finish().expect("a file")
    }

    #[test]
    fn files_are_those_of_the_formats_own_library_byte_for_byte() {
        let image = |frame: u8| (1, 10_000_000 * u64::from(frame), vec![frame; 300_000]);
        let note = |time_ns, channel| (channel, time_ns, b"ice".to_vec());
        // Several chunks, one channel without messages, and a time that goes back.
        let film: Vec<_> = (0..12).map(image).chain([note(7, 2), note(3, 2)]).collect();
        for messages in [vec![], vec![note(5, 3)], film] {
            let file = written(&messages);
            assert!(file == reference(&channels(), &messages), "{} messages", messages.len());
        }
    }

    #[test]
    fn the_next_file_has_the_same_channels() {
        let mut writer = Writer::new(Vec::new()).expect("a file");
        let _ = channels().map(|(topic, schema)| writer.channel(topic, schema));
        writer.message(1, 5, b"first").expect("a message");
        let mut next = writer.next(Vec::new()).expect("the next file");
        next.message(3, 6, b"ice").expect("a message");
        let messages = [(3, 6, b"ice".to_vec())];
        assert!(next.finish().expect("a file") == reference(&channels(), &messages));
        let messages = [(1, 5, b"first".to_vec())];
        assert!(writer.finish().expect("a file") == reference(&channels(), &messages));
    }

    #[test]
    fn the_size_of_a_file_is_known_before_it_is_finished() {
        for (count, length) in [(0, 0), (1, 1), (300, 10), (20, 300_000), (3, 2_000_000)] {
            let mut writer = Writer::new(Vec::new()).expect("a file");
            let _ = channels().map(|(topic, schema)| writer.channel(topic, schema));
            let new = count / 2;
            for number in 0..count - new {
                writer.message(1 + number % 3, 5, &vec![7; length]).expect("a message");
            }
            let bound = writer.finished_bytes((0..new).map(|_| length));
            for number in 0..new {
                writer.message(1 + number % 3, 5, &vec![7; length]).expect("a message");
            }
            let chunks = writer.chunk_indexes.len();
            let bytes = writer.finish().expect("a file").len() as u64;
            let slack = 200 * (1 + chunks) as u64;
            assert!(
                (bytes..=bytes + slack).contains(&bound),
                "{count} of {length}: {bound} for {bytes} bytes"
            );
        }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let file = written(&[(1, 5, vec![1, 2, 3]), (3, 6, b"ice".to_vec())]);
        let messages = mcap::MessageStream::new(&file).expect("a file");
        let messages: Vec<_> = messages.map(|message| message.expect("a message")).collect();
        let read = |index: usize| {
            (
                &messages[index].channel.topic[..],
                messages[index].log_time,
                &messages[index].data[..],
            )
        };
        assert_eq!((read(0), read(1)), (("/image", 5, &[1, 2, 3][..]), ("/panel_1", 6, &b"ice"[..])));
        let summary = mcap::Summary::read(&file).expect("a file").expect("a summary");
        assert_eq!(summary.stats.expect("statistics").message_count, 2);
    }
}
