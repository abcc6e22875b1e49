//! One file: messages in chunks.
//!
//! Chunks reach the disk whole, one after the other. One that does not, since the disk is full, waits in
//! memory; what was written of it is cut off. So a file ends between two chunks, also the file of a process
//! that was killed, unless it was killed during the write: then readers stop at the chunk before.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};

use super::encoder::{RecordedChannel, RecordedMessage};
use crate::io::ros::topics::Durability;
use ros_messages::{full_name, schema};

/// A chunk is closed when it is larger than this, bytes.
const CHUNK_BYTES: u64 = 768 * 1024;

/// A file of messages in the format MCAP.
pub struct McapFile {
    writer: Writer<NoSeek<Pending>>,
    /// Bytes that are not on the disk yet; shared with the writer.
    pending: Pending,
    disk: ChunkSink,
    channels: BTreeMap<usize, KnownChannel>,
}

/// The sink that chunks are written to.
struct ChunkSink {
    file: File,
    /// Bytes on the disk, all of them whole chunks.
    written: u64,
}

/// A channel of the file.
struct KnownChannel {
    id: u16,
    messages: u64,
}

/// Bytes between the writer and the disk.
#[derive(Debug, Clone, Default)]
struct Pending(Arc<Mutex<Vec<u8>>>);

impl McapFile {
    /// Makes the file, which must not exist unless `replace` is set.
    ///
    /// # Errors
    /// A file that cannot be made.
    pub fn create(path: &Path, replace: bool) -> io::Result<Self> {
        let mut options = File::options();
        options.write(true);
        let file = if replace { options.create(true).truncate(true) } else { options.create_new(true) }
            .open(path)?;
        let pending = Pending::default();
        let writer = WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(concat!("signal-gateway ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .create(NoSeek::new(pending.clone()))
            .map_err(io_error)?;
        Ok(Self { writer, pending, disk: ChunkSink { file, written: 0 }, channels: BTreeMap::new() })
    }

    /// Adds a message of one of `channels`, in memory.
    ///
    /// # Errors
    /// A message that does not fit the format.
    pub fn add(&mut self, message: &RecordedMessage, channels: &[RecordedChannel]) -> io::Result<()> {
        let Some(channel) = channels.get(message.channel) else { return Ok(()) };
        let id = self.channel_id(message.channel, channel)?;
        let payload = message.bytes.as_ref();
        let encapsulation = message.endian.encapsulation();
        let mut data = Vec::with_capacity(encapsulation.len() + payload.len());
        data.extend(encapsulation);
        data.extend(payload);
        let nanos = |stamp: i64| u64::try_from(stamp).unwrap_or(0);
        let known = self.channels.entry(message.channel).or_insert(KnownChannel { id, messages: 0 });
        let header = MessageHeader {
            channel_id: id,
            sequence: u32::try_from(known.messages & u64::from(u32::MAX)).unwrap_or(0),
            log_time: nanos(message.log_time.as_nanos()),
            publish_time: nanos(message.publish_time.as_nanos()),
        };
        known.messages += 1;
        self.writer.write_to_known_channel(&header, &data).map_err(io_error)
    }

    fn channel_id(&mut self, position: usize, channel: &RecordedChannel) -> io::Result<u16> {
        if let Some(known) = self.channels.get(&position) {
            return Ok(known.id);
        }
        let definition = schema(channel.type_name).unwrap_or_default();
        let schema = self.writer.add_schema(&full_name(channel.type_name), "ros2msg", definition.as_bytes());
        let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), offered_qos(channel))]);
        self.writer.add_channel(schema.map_err(io_error)?, &channel.topic, "cdr", &metadata).map_err(io_error)
    }

    /// Closes the chunk and writes to the disk all that waits for it.
    ///
    /// # Errors
    /// A disk that does not take it; all of it is written by the next call that succeeds.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io_error)?;
        self.write_pending()
    }

    /// Closes the file with its index. Then [`Self::write_pending`] until it succeeds, and nothing else.
    ///
    /// # Errors
    /// A disk that does not take it.
    pub fn finish(&mut self) -> io::Result<()> {
        self.writer.finish().map_err(io_error)?;
        self.write_pending()
    }

    /// Writes whole chunks that wait for the disk.
    ///
    /// # Errors
    /// A disk that does not take them.
    pub fn write_pending(&mut self) -> io::Result<()> {
        let mut pending = self.pending.lock();
        self.disk.append(&pending)?;
        pending.clear();
        Ok(())
    }

    /// Waits until the disk has all that was written.
    ///
    /// # Errors
    /// A disk that fails.
    pub fn sync(&self) -> io::Result<()> {
        self.disk.file.sync_all()
    }

    /// Number of bytes that wait for the disk, without the open chunk.
    pub fn pending_bytes(&self) -> usize {
        self.pending.lock().len()
    }

    /// Number of bytes on the disk.
    pub fn written_bytes(&self) -> u64 {
        self.disk.written
    }

    /// Number of messages of each channel, by its position.
    pub fn message_counts(&self) -> impl Iterator<Item = (usize, u64)> {
        self.channels.iter().map(|(channel, known)| (*channel, known.messages))
    }
}

impl ChunkSink {
    /// Writes `bytes` at the end, all of them or none.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = self.file.write_all(bytes);
        if written.is_err() {
            // A part of a chunk would mislead readers. Where even this fails, the next attempt writes over
            // it.
            let _ = self.file.set_len(self.written);
            let _ = self.file.seek(SeekFrom::Start(self.written));
        } else {
            self.written += u64::try_from(bytes.len()).unwrap_or(0);
        }
        written
    }
}

impl Pending {
    fn lock(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.lock().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The quality of service of a channel as `rosbag2` writes it up to ROS 2 Humble and reads it in every
/// version.
pub(super) fn offered_qos(channel: &RecordedChannel) -> String {
    let durability = match channel.durability {
        Durability::TransientLocal => 1,
        Durability::Volatile => 2,
    };
    let depth = channel.depth;
    let never = "\n    sec: 9223372036\n    nsec: 854775807";
    format!(
        "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline:{never}\n  \
         lifespan:{never}\n  liveliness: 1\n  liveliness_lease_duration:{never}\n  \
         avoid_ros_namespace_conventions: false"
    )
}

/// Errors of the writer itself; errors of the disk come from [`ChunkSink`].
fn io_error(error: McapError) -> io::Error {
    io::Error::other(error)
}
