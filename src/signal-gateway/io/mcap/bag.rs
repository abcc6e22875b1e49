//! A bag: a folder with a sequence of files and the `metadata.yaml` of `rosbag2`.

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::encoder::{RecordedChannel, RecordedMessage};
use super::file::{McapFile, offered_qos};

/// Limits after which a bag continues in a new file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileLimits {
    /// Size of a file, bytes; a file exceeds it by at most one chunk.
    pub bytes: u64,
    /// Time from the first to the last message of a file.
    pub duration: Duration,
}

impl FileLimits {
    /// No limits: one file for all messages.
    pub const NONE: Self = Self { bytes: u64::MAX, duration: Duration::MAX };
}

/// A bag that is being written.
pub struct Bag {
    folder: PathBuf,
    /// Name of its folder.
    pub(super) name: String,
    limits: FileLimits,
    channels: Vec<RecordedChannel>,
    /// The files in the folder, oldest first; the last may be open.
    files: VecDeque<BagFile>,
    open: Option<McapFile>,
    /// True if the open file has its index and only has to be written to the disk.
    is_finished: bool,
    next_number: u64,
}

/// A file's entry in the metadata.
#[derive(Debug, Clone, PartialEq, Eq)]
struct BagFile {
    name: String,
    bytes: u64,
    /// Log times of the first and the last message, ns since 1970.
    from: i64,
    to: i64,
    /// Number of messages by channel position.
    counts: BTreeMap<usize, u64>,
}

impl Bag {
    /// Creates the folder of a bag with messages of these channels. Fails if the folder exists or cannot be
    /// created.
    pub fn create(folder: &Path, limits: FileLimits, channels: &[RecordedChannel]) -> io::Result<Self> {
        fs::create_dir(folder)?;
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self {
            folder: folder.to_owned(),
            name,
            limits,
            channels: channels.to_vec(),
            files: VecDeque::new(),
            open: None,
            is_finished: false,
            next_number: 0,
        })
    }

    /// Adds a message in memory. The first message of a file creates the file. Fails, and the message is
    /// lost, if a file cannot be created, or if the end of a full file has not been written to the disk yet.
    pub fn add(&mut self, message: &RecordedMessage) -> io::Result<()> {
        if self.is_finished {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let at = message.log_time.as_nanos();
        if self.open.is_none() {
            let name = format!("{}_{}.mcap", self.name, self.next_number);
            self.open = Some(McapFile::create(&self.folder.join(&name), false)?);
            self.next_number += 1;
            self.files.push_back(BagFile { name, bytes: 0, from: at, to: at, counts: BTreeMap::new() });
        }
        if let (Some(file), Some(listed)) = (&mut self.open, self.files.back_mut()) {
            file.add(message, &self.channels)?;
            (listed.from, listed.to) = (listed.from.min(at), listed.to.max(at));
            *listed.counts.entry(message.channel).or_default() += 1;
        }
        Ok(())
    }

    /// Writes added messages to the disk, then the metadata; closes a file that has reached a limit. Fails if
    /// the disk does not accept the data. The next call tries again; added messages are not lost.
    pub fn flush(&mut self) -> io::Result<()> {
        let Some(file) = &mut self.open else { return Ok(()) };
        if self.is_finished {
            file.write_pending()?;
        } else {
            file.flush()?;
            let is_long = self.files.back().is_some_and(|listed| {
                let nanos = u64::try_from(listed.to.saturating_sub(listed.from)).unwrap_or(0);
                Duration::from_nanos(nanos) >= self.limits.duration
            });
            if is_long || file.written_bytes() >= self.limits.bytes {
                self.is_finished = true;
                file.finish()?;
            }
        }
        if let Some(listed) = self.files.back_mut() {
            listed.bytes = file.written_bytes();
        }
        if self.is_finished {
            (self.open, self.is_finished) = (None, false);
        }
        self.write_metadata()
    }

    /// Ends the bag. Fails if the disk does not accept the remaining data.
    pub fn finish(&mut self) -> io::Result<()> {
        if let (Some(file), false) = (&mut self.open, self.is_finished) {
            self.is_finished = true;
            // `flush` retries the data that the disk does not accept now.
            let _ = file.finish();
        }
        self.flush()
    }

    /// Returns the number of bytes that wait for the disk, without the open chunk.
    pub fn pending_bytes(&self) -> usize {
        self.open.as_ref().map_or(0, McapFile::pending_bytes)
    }

    /// Removes the oldest file, unless it is the only one, and returns its size in bytes. Fails if the file
    /// cannot be removed.
    pub fn remove_oldest(&mut self) -> io::Result<Option<u64>> {
        if self.files.len() < 2 {
            return Ok(None);
        }
        let Some(oldest) = self.files.pop_front() else { return Ok(None) };
        fs::remove_file(self.folder.join(&oldest.name))?;
        self.write_metadata()?;
        Ok(Some(oldest.bytes))
    }

    /// Returns the number of bytes in all files.
    pub fn bytes(&self) -> u64 {
        self.files.iter().map(|file| file.bytes).sum()
    }

    /// Returns the number of files.
    pub fn file_count(&self) -> usize {
        self.files.len()
    }

    fn write_metadata(&self) -> io::Result<()> {
        let draft = self.folder.join("metadata.yaml.draft");
        fs::write(&draft, self.metadata())?;
        fs::rename(draft, self.folder.join("metadata.yaml"))
    }

    /// Returns the metadata in the version of ROS 2 Humble, which later releases also read.
    fn metadata(&self) -> String {
        let from = self.files.iter().map(|file| file.from).min().unwrap_or(0);
        let to = self.files.iter().map(|file| file.to).max().unwrap_or(0);
        let total: u64 = self.files.iter().flat_map(|file| file.counts.values()).sum();
        let mut text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    \
             nanoseconds: {}\n  starting_time:\n    nanoseconds_since_epoch: {from}\n  message_count: {total}\n",
            to - from
        );
        text.push_str("  topics_with_message_count:\n");
        for (position, channel) in self.channels.iter().enumerate() {
            let count: u64 = self.files.iter().filter_map(|file| file.counts.get(&position)).sum();
            if count == 0 {
                continue;
            }
            // Writing to a String cannot fail. Names of topics need no quotes, see `topic_token` and the
            // configuration.
            let _ = write!(
                text,
                "    - topic_metadata:\n        name: {}\n        type: {}\n        \
                 serialization_format: cdr\n        offered_qos_profiles: {}\n      message_count: {count}\n",
                channel.topic,
                channel.type_name,
                quoted(&offered_qos(channel))
            );
        }
        text.push_str("  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n");
        for file in &self.files {
            let _ = writeln!(text, "    - {}", file.name);
        }
        text.push_str("  files:\n");
        for file in &self.files {
            let count: u64 = file.counts.values().sum();
            let _ = write!(
                text,
                "    - path: {}\n      starting_time:\n        nanoseconds_since_epoch: {}\n      duration:\n        \
                 nanoseconds: {}\n      message_count: {count}\n",
                file.name,
                file.from,
                file.to - file.from
            );
        }
        text
    }
}

/// Formats a multi-line text as a YAML scalar.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\n', "\\n"))
}
