//! One MCAP file: messages in chunks.
//!
//! Chunks are written to the disk one after the other, each as a whole. If the disk is full, the chunk waits
//! in memory and any part of it on the disk is truncated. A file therefore ends between two chunks, even if
//! the process is killed, unless that happens during a write: readers then stop at the previous chunk.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};

use super::encoder::{RecordedChannel, RecordedMessage};
use crate::io::lock::lock;
use crate::io::new_files;
use crate::io::ros::topics::Durability;
use ros_messages::schema;

/// A chunk is closed when it is larger than this, bytes.
const CHUNK_BYTES: u64 = 768 * 1024;

/// A file of messages in MCAP format.
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
    /// Number of bytes on the disk, in complete chunks only.
    written: u64,
}

struct KnownChannel {
    id: u16,
    messages: u64,
}

/// Bytes between the writer and the disk.
#[derive(Debug, Clone, Default)]
struct Pending(Arc<Mutex<Vec<u8>>>);

impl McapFile {
    /// Creates the file, which must not exist unless `replace` is set. Fails if the file cannot be created.
    pub fn create(path: &Path, replace: bool) -> io::Result<Self> {
        let file = new_files::create(path, replace)?;
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

    /// Adds a message of one of `channels` in memory. Fails if the message does not fit the format.
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
        let schema = self.writer.add_schema(channel.type_name, "ros2msg", definition.as_bytes());
        let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), offered_qos(channel))]);
        self.writer.add_channel(schema.map_err(io_error)?, &channel.topic, "cdr", &metadata).map_err(io_error)
    }

    /// Closes the chunk and writes all pending data to the disk. Fails if the disk does not accept the data;
    /// the next successful call writes all of it.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io_error)?;
        self.write_pending()
    }

    /// Closes the file with its index. Afterwards call only [`Self::write_pending`], until it succeeds. Fails
    /// if the disk does not accept the data.
    pub fn finish(&mut self) -> io::Result<()> {
        self.writer.finish().map_err(io_error)?;
        self.write_pending()
    }

    /// Writes complete pending chunks to the disk. Fails if the disk does not accept them.
    pub fn write_pending(&mut self) -> io::Result<()> {
        let mut pending = lock(&self.pending.0);
        self.disk.append(&pending)?;
        pending.clear();
        Ok(())
    }

    /// Waits until all written data is on the disk. Fails if the disk fails.
    pub fn sync(&self) -> io::Result<()> {
        self.disk.file.sync_all()
    }

    /// Returns the number of bytes that wait for the disk, without the open chunk.
    pub fn pending_bytes(&self) -> usize {
        lock(&self.pending.0).len()
    }

    /// Returns the number of bytes on the disk.
    pub fn written_bytes(&self) -> u64 {
        self.disk.written
    }
}

impl ChunkSink {
    /// Writes `bytes` at the end, all of them or none.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = self.file.write_all(bytes);
        if written.is_err() {
            // A part of a chunk would mislead readers. If truncating fails too, the next attempt overwrites
            // it.
            let _ = self.file.set_len(self.written);
            let _ = self.file.seek(SeekFrom::Start(self.written));
        } else {
            self.written += u64::try_from(bytes.len()).unwrap_or(0);
        }
        written
    }
}

impl Write for Pending {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        lock(&self.0).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Returns the quality of service of a channel in the form that `rosbag2` writes up to ROS 2 Humble and reads
/// in every version.
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

/// Converts errors of the writer itself; disk errors come from [`ChunkSink`].
fn io_error(error: McapError) -> io::Error {
    io::Error::other(error)
}
