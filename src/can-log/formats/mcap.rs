//! MCAP: the files of rosbag2, Foxglove and the gateway itself (`run --record`).
//!
//! A file is a sequence of records, most of them in chunks, which are plain, lz4 or zstd. They are read in
//! sequence, so that a file without its end, as left by a killed recorder, is read as well; the index is not
//! needed. Memory is used for the packed bytes of a chunk, the window of its decoder, and the topics that are
//! read. A chunk that cannot be unpacked, or has a wrong checksum, counts as a bad object.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Cursor, ErrorKind, Read};

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};
use mcap::records::op;

use super::recorded_topics::{Choose, LoggedMessage, MessageReader, RecordedTopic, TopicChoice};
use super::ros_frames::{Frames, choose_frames};
use crate::compression::decompressed;
use crate::entry::BadLine;
use crate::exact::{append, append_rest, skip};
use crate::file_budget::{Kept, is_limit};
use crate::format::{Mark, ObjectFormat, ObjectSource, damaged};
use crate::little_endian::{u16_at, u32_at, u64_at};
use gateway_base::time::WallStamp;

pub(super) const FORMAT: ObjectFormat = ObjectFormat {
    name: "MCAP",
    mark: Mark::Magics(&[MAGIC]),
    reader: |source| Ok(Box::new(Frames(Mcap::new(source, choose_frames())?))),
};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Maximum packed size of a chunk, bytes; writers fill chunks with some hundred KiB to some MiB.
const MAX_CHUNK: u64 = 256 << 20;
/// Largest schema, channel, or message of a topic that is read, bytes.
const MAX_RECORD: u64 = 1 << 20;
/// Longest name of a topic or type that is read, bytes; ROS 2 allows 255.
const MAX_NAME: usize = 1024;
/// Memory of a map entry besides its name, bytes.
const NODE: usize = 64;
/// Cost of a record, nominal ns.
const RECORD_WORK: u64 = 100;
/// Length of the head of a message: channel, sequence, log time, publish time.
const MESSAGE_HEAD: usize = 22;
/// Length of the head of a chunk before the name of its compression: two times, size, checksum, length of the
/// name.
const CHUNK_HEAD: usize = 32;

static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// Reads the messages of the chosen topics.
pub(super) struct Mcap<T> {
    file: ObjectSource,
    chunk: Option<Chunk>,
    content: Content<T>,
    is_ended: bool,
}

/// State derived from the records.
struct Content<T> {
    schemas: BTreeMap<u16, String>,
    /// `None` for a channel whose topic is not read.
    channels: BTreeMap<u16, Option<T>>,
    choice: TopicChoice<T>,
    record: Vec<u8>,
    /// Memory of the buffer `record`.
    buffered: Kept,
    /// Memory of the names of schemas and channels.
    kept: Kept,
    /// Channel and log time of the message in `record`.
    message: Option<(u16, WallStamp)>,
}

struct Chunk {
    /// Memory of the packed bytes.
    _kept: Kept,
    records: BufReader<Checked<Box<dyn Read + Send>>>,
    /// Checksum of the unpacked records; 0 if there is none.
    checksum: u32,
    /// True if the file ends within the chunk.
    is_cut: bool,
}

/// Computes the checksum of the bytes read.
struct Checked<R> {
    source: R,
    digest: Digest<'static, u32, Table<16>>,
}

impl<R: Read> Read for Checked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.source.read(buffer)?;
        self.digest.update(&buffer[..read]);
        Ok(read)
    }
}

/// The record that was read.
enum Step {
    /// A message of a topic that is read, which [`Content`] holds.
    Message,
    /// A message of such a topic, longer than the maximum.
    TooLong,
    /// The head of a chunk follows.
    Chunk,
    /// The records end here.
    DataEnd,
    /// Any other record.
    Other,
}

impl<T> Mcap<T> {
    /// Reads a file from its first byte on.
    pub(super) fn new(mut file: ObjectSource, choose: Choose<T>) -> io::Result<Self> {
        let mut magic = [0; 8];
        file.read_exact(&mut magic)?;
        let (schemas, channels, record) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
        let (choice, buffered, kept) = (TopicChoice::new(choose), file.budget.keep(), file.budget.keep());
        let content = Content { schemas, channels, choice, record, buffered, kept, message: None };
        Ok(Self { file, chunk: None, content, is_ended: false })
    }
}

impl<T: Send> MessageReader<T> for Mcap<T> {
    fn advance(&mut self) -> io::Result<Option<Result<(), BadLine>>> {
        while !self.is_ended {
            let Some(chunk) = &mut self.chunk else {
                match self.content.read_record(&mut self.file)? {
                    Some(Step::Message) => return Ok(Some(Ok(()))),
                    Some(Step::TooLong) => return Ok(Some(Err(BadLine::TooLong))),
                    Some(Step::Chunk) => self.chunk = Some(Chunk::read(&mut self.file)?),
                    Some(Step::Other) => {}
                    Some(Step::DataEnd) => self.is_ended = true,
                    // A file without its end record was cut.
                    None => return Err(ErrorKind::UnexpectedEof.into()),
                }
                continue;
            };
            let step = self.content.read_record(&mut chunk.records);
            match step {
                Ok(Some(Step::Message)) => return Ok(Some(Ok(()))),
                Ok(Some(Step::TooLong)) => return Ok(Some(Err(BadLine::TooLong))),
                Ok(Some(Step::Other)) => continue,
                Err(error) if is_limit(&error) => return Err(error),
                Ok(None | Some(Step::Chunk | Step::DataEnd)) | Err(_) => {}
            }
            let (is_cut, is_whole) = (chunk.is_cut, matches!(step, Ok(None)) && chunk.is_intact());
            self.chunk = None;
            if is_cut {
                return Err(ErrorKind::UnexpectedEof.into());
            }
            if !is_whole {
                return Ok(Some(Err(BadLine::BadData)));
            }
        }
        Ok(None)
    }

    fn message(&self) -> Option<LoggedMessage<'_, T>> {
        let (channel, logged) = self.content.message?;
        let topic = self.content.channels.get(&channel)?.as_ref()?;
        Some(LoggedMessage { topic, logged, bytes: &self.content.record })
    }

    fn choice(&self) -> &TopicChoice<T> {
        &self.content.choice
    }
}

impl Chunk {
    /// Reads a chunk after the head of its record.
    fn read(file: &mut ObjectSource) -> io::Result<Self> {
        let mut head = [0; CHUNK_HEAD];
        file.read_exact(&mut head)?;
        let (checksum, name_length) = (u32_at(&head, 24), u32_at(&head, 28));
        if name_length > 64 {
            return Err(damaged("a chunk has no compression that is known"));
        }
        let mut name = Vec::new();
        file.take(name_length.into()).read_to_end(&mut name)?;
        let mut length = [0; 8];
        file.read_exact(&mut length)?;
        let length = u64::from_le_bytes(length);
        if length > MAX_CHUNK {
            return Err(damaged("a chunk is larger than 256 MiB"));
        }
        let (mut packed, mut kept) = (Vec::new(), file.budget.keep());
        let is_cut = append_rest(file, length, &mut packed, &mut kept)? < length;
        let packed = Box::new(Cursor::new(packed));
        let source = if name.is_empty() { packed } else { decompressed(packed, &file.budget)? };
        let records = BufReader::new(Checked { source, digest: CRC.digest() });
        Ok(Self { _kept: kept, records, checksum, is_cut })
    }

    /// Returns true if the checksum of all records equals the chunk's.
    fn is_intact(&self) -> bool {
        self.checksum == 0 || self.records.get_ref().digest.clone().finalize() == self.checksum
    }
}

/// The rest of a record's content; each part is `None` if it extends beyond the end.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(bytes)
    }

    fn id(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.bytes(2)?.try_into().ok()?))
    }

    /// Returns bytes preceded by their length.
    fn block(&mut self) -> Option<&'a [u8]> {
        let length = u32::from_le_bytes(self.bytes(4)?.try_into().ok()?);
        self.bytes(usize::try_from(length).ok()?)
    }

    fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.block()?).ok()
    }

    /// Returns number and name of a schema, and leaves its encoding and content.
    fn schema(&mut self) -> Option<(u16, &'a str)> {
        let schema = (self.id()?, self.text()?);
        self.text()?;
        self.block()?;
        Some(schema)
    }

    /// Returns number, schema, topic and encoding of a channel, and leaves its metadata.
    fn channel(&mut self) -> Option<(u16, u16, &'a str, &'a str)> {
        let channel = (self.id()?, self.id()?, self.text()?, self.text()?);
        self.block()?;
        Some(channel)
    }
}

impl<T> Content<T> {
    /// Reads the next record, and stores the state of topics that are read; `None` at the end of the source.
    fn read_record(&mut self, source: &mut impl Read) -> io::Result<Option<Step>> {
        let mut head = [0; 9];
        if source.read(&mut head[..1])? == 0 {
            return Ok(None);
        }
        self.kept.budget().spend(RECORD_WORK)?;
        source.read_exact(&mut head[1..])?;
        let (opcode, length) = (head[0], u64_at(&head, 1));
        match opcode {
            op::CHUNK => return Ok(Some(Step::Chunk)),
            op::DATA_END | op::FOOTER => return Ok(Some(Step::DataEnd)),
            op::MESSAGE => return self.read_message(source, length).map(Some),
            op::SCHEMA | op::CHANNEL if length <= MAX_RECORD => {}
            _ => {
                skip(source, length)?;
                return Ok(Some(Step::Other));
            }
        }
        self.read_body(source, length)?;
        // The crate's own parser reserves as many bytes as a text announces.
        let mut fields = Fields(&self.record);
        if opcode == op::SCHEMA {
            let (id, name) = fields.schema().ok_or_else(|| damaged("a schema is damaged"))?;
            // A longer name cannot be the name of a type that is read.
            if name.len() <= MAX_NAME {
                self.kept.grow((NODE + name.len()) as u64)?;
                self.schemas.insert(id, name.to_owned());
            } else {
                self.schemas.remove(&id);
            }
            return Ok(Some(Step::Other));
        }
        let (id, schema, name, encoding) = fields.channel().ok_or_else(|| damaged("a channel is damaged"))?;
        let type_name = self.schemas.get(&schema).map_or("", String::as_str);
        let topic = RecordedTopic { name, type_name, encoding };
        let chosen = if name.len() <= MAX_NAME { self.choice.take(&topic) } else { None };
        self.kept.grow((NODE + name.len().min(MAX_NAME)) as u64)?;
        self.channels.insert(id, chosen);
        Ok(Some(Step::Other))
    }

    fn read_message(&mut self, source: &mut impl Read, length: u64) -> io::Result<Step> {
        let mut head = [0; MESSAGE_HEAD];
        let rest = length.checked_sub(MESSAGE_HEAD as u64).ok_or_else(|| damaged("a message has no head"))?;
        source.read_exact(&mut head)?;
        let channel = u16_at(&head, 0);
        let is_read = self.channels.get(&channel).is_some_and(Option::is_some);
        if !is_read || rest > MAX_RECORD {
            skip(source, rest)?;
            return Ok(if is_read { Step::TooLong } else { Step::Other });
        }
        let logged = i64::try_from(u64_at(&head, 6)).unwrap_or(i64::MAX);
        self.message = Some((channel, WallStamp::from_nanos(logged)));
        self.read_body(source, rest)?;
        Ok(Step::Message)
    }

    fn read_body(&mut self, source: &mut impl Read, length: u64) -> io::Result<()> {
        self.record.clear();
        append(source, length, &mut self.record, &mut self.buffered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use ros_messages::builtin_interfaces::Time;
    use ros_messages::can_msgs;
    use ros_messages::cdr::CdrBytes;
    use ros_messages::std_msgs::Header;
    use std::io::Write as _;

    type Pack = fn(&[u8]) -> Vec<u8>;

    fn lz4(records: &[u8]) -> Vec<u8> {
        let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
        encoder.write_all(records).unwrap();
        encoder.finish().unwrap()
    }

    fn zstd(records: &[u8]) -> Vec<u8> {
        ruzstd::encoding::compress_to_vec(records, ruzstd::encoding::CompressionLevel::Fastest)
    }

    const PACKINGS: [(&str, Pack); 3] = [("", <[u8]>::to_vec), ("lz4", lz4), ("zstd", zstd)];

    fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
        [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
    }

    fn text(text: &str) -> Vec<u8> {
        [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat()
    }

    fn schema(id: u16, name: &str) -> Vec<u8> {
        record(op::SCHEMA, &[id.to_le_bytes().to_vec(), text(name), text("ros2msg"), text("")].concat())
    }

    fn channel(id: u16, schema: u16, topic: &str) -> Vec<u8> {
        let numbers = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        record(op::CHANNEL, &[numbers, text(topic), text("cdr"), vec![0; 4]].concat())
    }

    fn message(channel: u16, content: &[u8]) -> Vec<u8> {
        let head = [&channel.to_le_bytes()[..], &[0; 20]].concat();
        record(op::MESSAGE, &[&head, content].concat())
    }

    fn frame(number: u32) -> Vec<u8> {
        let frame = can_msgs::Frame {
            header: Header { stamp: Time { sec: 1, nanosec: number * 1000 }, frame_id: "can".to_owned() },
            id: 0x100,
            is_rtr: false,
            is_extended: false,
            is_error: false,
            dlc: 4,
            data: u64::from(number).to_le_bytes(),
        };
        [&[0, 1, 0, 0], CdrBytes::encode(&frame).unwrap().as_ref()].concat()
    }

    fn chunk(compression: &str, pack: Pack, records: &[u8]) -> Vec<u8> {
        let packed = pack(records);
        let sizes = [&[0; 16][..], &(records.len() as u64).to_le_bytes()].concat();
        let checksum = CRC.checksum(records).to_le_bytes().to_vec();
        let length = (packed.len() as u64).to_le_bytes().to_vec();
        record(op::CHUNK, &[sizes, checksum, text(compression), length, packed].concat())
    }

    /// Returns two chunks of 50 frames among messages without frames.
    fn file(compression: &str, pack: Pack) -> Vec<u8> {
        let described = [
            schema(1, "can_msgs/msg/Frame"),
            schema(2, "std_msgs/msg/String"),
            channel(1, 1, "/body/from_can_bus"),
            channel(2, 2, "/chatter"),
        ]
        .concat();
        let chunks = (0..2).flat_map(|half| {
            let frames =
                (half * 50..half * 50 + 50).flat_map(|at| [message(2, b"text"), message(1, &frame(at))]);
            let records = std::iter::once(described.clone()).chain(frames).collect::<Vec<_>>().concat();
            chunk(compression, pack, &records)
        });
        let end = [record(op::DATA_END, &[0; 4]), record(op::FOOTER, &[0; 20]), MAGIC.to_vec()].concat();
        [MAGIC.to_vec(), record(op::HEADER, &[0; 8]), chunks.collect(), end].concat()
    }

    fn read(file: &[u8]) -> (Vec<Result<String, BadLine>>, io::Result<()>) {
        let mut entries = Vec::new();
        let mut reader = match (FORMAT.reader)(crate::format::testing::source(file)) {
            Ok(reader) => reader,
            Err(error) => return (entries, Err(error)),
        };
        loop {
            match reader.next_object() {
                Ok(Some(outcome)) => entries.extend(
                    outcome
                        .map(|entry| entry.map(|entry| crate::format::testing::shown(&entry, 0)))
                        .transpose(),
                ),
                Ok(None) => return (entries, Ok(())),
                Err(error) => return (entries, Err(error)),
            }
        }
    }

    fn expected() -> Vec<Result<String, BadLine>> {
        (0..100_u32).map(|at| Ok(format!("{} body 100#{:02X}000000", 1_000_000 + at, at))).collect()
    }

    #[test]
    fn frames_are_read_from_plain_and_packed_chunks_and_without_chunks() {
        for (compression, pack) in PACKINGS {
            let (entries, end) = read(&file(compression, pack));
            assert!(end.is_ok() && entries == expected(), "{compression}: {entries:?}");
        }
        let records =
            [schema(1, "can_msgs/msg/Frame"), channel(1, 1, "/body/from_can_bus"), message(1, &frame(0))];
        let (entries, end) = read(&[MAGIC, &records.concat(), &record(op::DATA_END, &[0; 4])].concat());
        assert!(end.is_ok());
        assert_eq!(entries, expected()[..1]);
    }

    #[test]
    fn a_cut_file_gives_the_frames_before_its_end() {
        for (compression, pack) in PACKINGS {
            let file = file(compression, pack);
            let end = [record(op::DATA_END, &[0; 4]), record(op::FOOTER, &[0; 20]), MAGIC.to_vec()].concat();
            let end = file.len() - end.len();
            for length in (0..end).step_by(7) {
                let (entries, outcome) = read(&file[..length]);
                assert_eq!(outcome.unwrap_err().kind(), ErrorKind::UnexpectedEof, "{compression}: {length}");
                assert!(expected().starts_with(&entries), "{compression}: {length}: {entries:?}");
            }
            // Unpacks the available part of an incomplete chunk: for LZ4 and Zstandard whole blocks, here
            // one.
            let (entries, _) = read(&file[..end - 60]);
            let least = if compression.is_empty() { 98 } else { 50 };
            assert!(entries.len() >= least, "{compression}: {}", entries.len());
        }
    }

    #[test]
    fn a_damaged_chunk_counts_and_the_next_one_is_read() {
        for (compression, pack) in PACKINGS {
            let mut file = file(compression, pack);
            // In the first chunk, after its head.
            file[150] ^= 0x40;
            let (entries, end) = read(&file);
            assert!(end.is_ok(), "{compression}: {end:?}");
            assert!(entries.contains(&Err(BadLine::BadData)), "{compression}: {entries:?}");
            assert!(entries.ends_with(&expected()[50..]), "{compression}");
        }
    }

    #[test]
    fn a_file_without_frames_is_refused_with_its_topics() {
        let records =
            [schema(2, "std_msgs/msg/String"), channel(2, 2, "/chatter"), message(2, b"text")].concat();
        let file = [MAGIC.to_vec(), records, record(op::DATA_END, &[0; 4])].concat();
        let (entries, end) = read(&file);
        assert_eq!(entries, []);
        assert_eq!(
            end.unwrap_err().to_string(),
            "the recording has no topic with received CAN frames; it has /chatter; \
             record a topic of can_msgs/msg/Frame or ros2_socketcan_msgs/msg/FdFrame"
        );
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_without_panic(
            bytes in proptest::collection::vec(any::<u8>(), 0..300),
            changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
            packing in 0..3_usize,
        ) {
            let (entries, _) = read(&[MAGIC, &bytes].concat());
            prop_assert!(entries.len() <= 300);
            let (compression, pack) = PACKINGS[packing];
            let mut file = file(compression, pack);
            for (at, byte) in changes {
                let at = at.index(file.len());
                file[at] = byte;
            }
            let (entries, _) = read(&file);
            prop_assert!(entries.len() <= 200);
        }
    }
}
