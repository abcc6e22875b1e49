//! One topic we write: its writer, the current samples, their delivery and withdrawal.
//!
//! A reader learns of a new writer some milliseconds after the writer exists. A volatile writer
//! sends it only what comes after that, and a volatile reader need not take what came before. So
//! that a report is not lost on readers which knew the writer's predecessor, it is repeated (same
//! stamp) a few times in the writer's first seconds.
//!
//! RustDDS trims a transient-local writer's history every 6 s, up to what all readers have acknowledged;
//! without readers it keeps thousands of samples, whatever the depth. A late joiner would be handed minutes
//! of old samples before the current one. So while there is no reader, nothing is written and the history is
//! empty; the current samples are written when one joins. While others read, the history has seconds of
//! samples nonetheless. RustDDS tells of a reader that it has discovered before it hands over anything: the
//! reader has to ask first, and is answered after 5 ms. By then the writer is gone, and the reader finds a
//! new, empty one instead, as do the others, which lose nothing but what was outdated.

use std::time::{Duration, Instant};

use rustdds::dds::result::CreateResult;
use rustdds::{GUID, Publisher, RTPSEntity, Timestamp, Topic};

use super::history::History;
use super::recent_samples::RecentSamples;
use super::sample::{Padded, SampleWriter};
use crate::link::WrittenTopic;
use crate::qos::{Delivery, Durability};
use ros_messages::cdr::CdrBytes;

/// Times since a writer's first report at which it repeats the current report.
const REPEATS: [Duration; 4] =
    [Duration::from_millis(100), Duration::from_millis(300), Duration::from_secs(1), Duration::from_secs(3)];
/// Longest time that a withdrawal waits for readers to acknowledge what was sent before.
const ACKNOWLEDGE: Duration = Duration::from_millis(100);
/// Time for which a new writer is not replaced because its history is long: its readers come one by one.
const SETTLING: Duration = Duration::from_secs(2);
/// Time for which a new writer is not replaced for a late reader, so that many of them do not keep others
/// from reading. It is the most history that a late reader gets.
const MIN_LIFE: Duration = Duration::from_secs(1);

/// A topic of one participant.
pub(super) struct DdsTopicWriter {
    publisher: Publisher,
    topic: Topic,
    durability: Durability,
    delivery: Delivery,
    /// Publications that a late reader may be handed.
    depth: usize,
    writer: SampleWriter,
    /// Time of the writer's first sample, or of its creation.
    first_write: Instant,
    repeats: usize,
    /// Samples for a late joiner; empty when withdrawn.
    current: Vec<CdrBytes>,
    /// Of a log: the samples for those that come later.
    recent: RecentSamples,
    /// The writer has written a sample.
    used: bool,
    /// Number of publications so far.
    publications: u64,
    history: History,
    /// Number of matched readers at the last call of [`settle`](Self::settle).
    readers: usize,
    /// Everything was acknowledged at some moment since the last call of
    /// [`is_acknowledged`](Self::is_acknowledged).
    acknowledged: bool,
}

impl DdsTopicWriter {
    /// A topic on which nothing was published yet; the quality of service is the topic's.
    pub(super) fn new(publisher: &Publisher, topic: Topic, written: &WrittenTopic) -> CreateResult<Self> {
        let writer = publisher.create_datawriter_no_key::<CdrBytes, Padded>(&topic, None)?;
        Ok(Self {
            publisher: publisher.clone(),
            topic,
            durability: written.durability,
            delivery: written.delivery,
            depth: usize::try_from(written.depth).unwrap_or_default(),
            writer,
            first_write: Instant::now(),
            repeats: 0,
            current: Vec::new(),
            recent: RecentSamples::default(),
            used: false,
            publications: 0,
            history: History::default(),
            readers: 0,
            acknowledged: false,
        })
    }

    /// The writer's identity; changes when a report is withdrawn.
    pub(super) fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Publishes, if there is a reader; else the first one to join gets it. [`Delivery::Once`]
    /// and [`Delivery::Live`] go out in any case.
    /// The error is the text of RustDDS.
    pub(super) fn publish(&mut self, samples: &[CdrBytes], readers: usize) -> Result<(), String> {
        self.publications += 1;
        if matches!(self.delivery, Delivery::Once | Delivery::Live) {
            return self.write(samples);
        }
        if self.delivery == Delivery::Log {
            self.recent.add(Instant::now(), samples);
            // An unused writer writes them with those before, once it has a reader.
            return if self.used { self.write(samples) } else { Ok(()) };
        }
        self.current = samples.to_vec();
        if readers > 0 || self.durability == Durability::Volatile { self.write(samples) } else { Ok(()) }
    }

    /// Publishes nothing from now on, not even to readers that come later. True when that made a new writer.
    pub(super) fn withdraw(&mut self) -> Result<bool, String> {
        let is_empty = std::mem::take(&mut self.current).is_empty() || !self.used;
        if is_empty || self.durability == Durability::Volatile {
            return Ok(false);
        }
        // Readers that do not acknowledge in time are taken for gone.
        let _ = self.writer.wait_for_acknowledgments(ACKNOWLEDGE);
        self.begin_anew()
    }

    /// Keeps a reader that was discovered, and asks for history, from being handed more than the topic's
    /// depth. Call it at once, before RustDDS answers the reader. True when that made a new writer.
    pub(super) fn meet_late_reader(&mut self) -> Result<bool, String> {
        let counts_newest = matches!(self.delivery, Delivery::Report | Delivery::Stream);
        let is_long = self.history.publications() > self.depth;
        if counts_newest && self.used && is_long && self.first_write.elapsed() >= MIN_LIFE {
            self.begin_anew()
        } else {
            Ok(false)
        }
    }

    /// The most bytes that RustDDS may hold of a topic until its readers have acknowledged them; none of a
    /// new writer, which is not replaced.
    pub(super) fn history_bytes(&self) -> usize {
        if self.used && self.first_write.elapsed() >= SETTLING { self.history.bytes } else { 0 }
    }

    /// A new writer, which has no history.
    pub(super) fn begin_anew(&mut self) -> Result<bool, String> {
        let fresh = self.publisher.create_datawriter_no_key::<CdrBytes, Padded>(&self.topic, None);
        self.writer = fresh.map_err(|error| error.to_string())?;
        self.used = false;
        self.history = History::default();
        Ok(true)
    }

    /// True if every reader has acknowledged everything, now or at some moment since the last call: that is
    /// seldom so at the very moment of the call on a busy writer. Waits some milliseconds for
    /// acknowledgements in transit.
    pub(super) fn is_acknowledged(&mut self) -> bool {
        std::mem::take(&mut self.acknowledged) || self.has_all_acknowledged(Duration::from_millis(5))
    }

    /// A writer for which RustDDS reports an error counts as acknowledged.
    fn has_all_acknowledged(&self, patience: Duration) -> bool {
        self.writer.wait_for_acknowledgments(patience).unwrap_or(true)
    }

    /// Writes the current samples for the first reader, and repeats a report when that is due; drops the
    /// history of readers that are gone. True when that made a new writer.
    pub(super) fn settle(&mut self, readers: usize) -> Result<bool, String> {
        let joined = readers > std::mem::replace(&mut self.readers, readers);
        if self.has_all_acknowledged(Duration::ZERO) {
            self.acknowledged = true;
            self.history.acknowledged(Instant::now());
        }
        let is_transient = self.durability == Durability::TransientLocal;
        if matches!(self.delivery, Delivery::Once | Delivery::Live) {
            return Ok(false);
        }
        if readers == 0 && is_transient {
            return if self.used { self.begin_anew() } else { Ok(false) };
        }
        if self.delivery == Delivery::Log {
            let recent = self.recent.now(Instant::now());
            return match (self.used, recent.is_empty()) {
                (false, _) => self.write(&recent).map(|()| false),
                // What RustDDS still holds is too old for who joins.
                (true, true) if joined => self.begin_anew(),
                (true, _) => Ok(false),
            };
        }
        let age = self.first_write.elapsed();
        let due = match self.delivery {
            Delivery::Report => REPEATS.iter().filter(|repeat| **repeat <= age).count(),
            Delivery::Stream | Delivery::Live | Delivery::Once | Delivery::Log => self.repeats,
        };
        if due > self.repeats || !self.used {
            self.repeats = due;
            self.write(&self.current.clone())?;
        }
        Ok(false)
    }

    fn write(&mut self, samples: &[CdrBytes]) -> Result<(), String> {
        for sample in samples {
            if !self.used {
                self.used = true;
                self.first_write = Instant::now();
                self.repeats = 0;
            }
            if self.durability == Durability::TransientLocal {
                self.history.add(Instant::now(), sample.as_ref().len(), self.publications);
            }
            let written = self.writer.write(sample.clone(), Some(Timestamp::now()));
            written.map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}
