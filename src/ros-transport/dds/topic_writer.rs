//! One written topic: its writer, the current samples, their delivery and withdrawal.
//!
//! A reader discovers a new writer some milliseconds after the writer is created. A volatile writer sends
//! only later samples to it, and a volatile reader need not accept earlier ones. So that readers which knew
//! the writer's predecessor do not miss a report, it is repeated (same stamp) a few times in the writer's
//! first seconds.
//!
//! RustDDS trims the history every 6 s only (`docs/development/rustdds.md`). So while there is no reader,
//! nothing is written and the history is empty; the current samples are written when a reader joins. While
//! other readers exist, a discovered reader that requests the history is answered after 5 ms. By then the
//! writer is gone, and all readers find a new, empty writer instead; the others lose only outdated samples.

use std::time::{Duration, Instant};

use rustdds::dds::result::CreateResult;
use rustdds::{GUID, Publisher, RTPSEntity, Timestamp, Topic};

use super::history::History;
use super::recent_samples::RecentSamples;
use super::sample::SampleWriter;
use crate::error::TransportError;
use crate::link::WrittenTopic;
use crate::qos::{Delivery, Durability};
use ros_messages::cdr::CdrBytes;

/// Times since a writer's first report at which it repeats the current report.
const REPEATS: [Duration; 4] =
    [Duration::from_millis(100), Duration::from_millis(300), Duration::from_secs(1), Duration::from_secs(3)];
/// Maximum time that a withdrawal waits for readers to acknowledge earlier samples.
const ACKNOWLEDGE: Duration = Duration::from_millis(100);
/// Time for which a new writer is not replaced for its long history, since its readers join one by one.
const SETTLING: Duration = Duration::from_secs(2);
/// Time for which a new writer is not replaced for a late reader, so that many late readers do not keep
/// others from receiving. A late reader gets at most this much history.
const MIN_LIFE: Duration = Duration::from_secs(1);

/// A topic of one participant.
pub(super) struct DdsTopicWriter {
    publisher: Publisher,
    topic: Topic,
    durability: Durability,
    delivery: Delivery,
    /// Maximum number of publications that a late reader may receive.
    depth: usize,
    writer: SampleWriter,
    /// Number of writers before this one.
    pub(super) replaced: u32,
    /// Time of the writer's first sample, or of its creation.
    first_write: Instant,
    repeats: usize,
    /// Samples for a late reader; empty when withdrawn.
    current: Vec<CdrBytes>,
    /// For a log topic: the samples for late readers.
    recent: RecentSamples,
    used: bool,
    publications: u64,
    history: History,
    /// Number of matched readers at the last call of [`settle`](Self::settle).
    readers: usize,
    /// Everything was acknowledged at some moment since the last call of
    /// [`is_acknowledged`](Self::is_acknowledged).
    acknowledged: bool,
}

impl DdsTopicWriter {
    /// Creates a topic without publications; the quality of service is the topic's.
    pub(super) fn new(publisher: &Publisher, topic: Topic, written: &WrittenTopic) -> CreateResult<Self> {
        Ok(Self {
            publisher: publisher.clone(),
            durability: written.durability,
            delivery: written.delivery,
            depth: usize::try_from(written.depth).unwrap_or_default(),
            writer: publisher.create_datawriter_no_key(&topic, None)?,
            topic,
            replaced: 0,
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

    /// Returns the writer's identity, which changes when a report is withdrawn.
    pub(super) fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Publishes if there is a reader; otherwise the first reader to join gets the samples.
    /// [`Delivery::Once`] and [`Delivery::Live`] are sent in any case.
    pub(super) fn publish(&mut self, samples: &[CdrBytes], readers: usize) -> Result<(), TransportError> {
        self.publications += 1;
        if matches!(self.delivery, Delivery::Once | Delivery::Live) {
            return self.write(samples);
        }
        if self.delivery == Delivery::Log {
            self.recent.add(Instant::now(), samples);
            // An unused writer writes them together with earlier samples, once it has a reader.
            return if self.used { self.write(samples) } else { Ok(()) };
        }
        self.current = samples.to_vec();
        if readers > 0 || self.durability == Durability::Volatile { self.write(samples) } else { Ok(()) }
    }

    /// Publishes nothing from now on, not even to late readers.
    pub(super) fn withdraw(&mut self) -> Result<(), TransportError> {
        let is_empty = std::mem::take(&mut self.current).is_empty() || !self.used;
        if is_empty || self.durability == Durability::Volatile {
            return Ok(());
        }
        // Readers that do not acknowledge in time are considered gone.
        let _ = self.writer.wait_for_acknowledgments(ACKNOWLEDGE);
        self.begin_anew()
    }

    /// Prevents a newly discovered reader that requests history from receiving more than the topic's depth.
    /// Call it at once, before RustDDS answers the reader.
    pub(super) fn meet_late_reader(&mut self) -> Result<(), TransportError> {
        let counts_newest = matches!(self.delivery, Delivery::Report | Delivery::Stream);
        let is_long = self.history.publications() > self.depth;
        if counts_newest && self.used && is_long && self.first_write.elapsed() >= MIN_LIFE {
            self.begin_anew()
        } else {
            Ok(())
        }
    }

    /// Returns the maximum number of bytes that RustDDS may hold for a topic until its readers have
    /// acknowledged them; 0 for a new writer, which is not replaced.
    pub(super) fn history_bytes(&self) -> usize {
        if self.used && self.first_write.elapsed() >= SETTLING { self.history.bytes } else { 0 }
    }

    /// Creates a new writer, which has no history.
    pub(super) fn begin_anew(&mut self) -> Result<(), TransportError> {
        self.writer = self.publisher.create_datawriter_no_key(&self.topic, None)?;
        self.replaced += 1;
        self.used = false;
        self.history = History::default();
        Ok(())
    }

    /// Returns true if every reader has acknowledged everything, now or at some time since the last call: on
    /// a busy writer this is seldom so at the time of the call. Waits some milliseconds for acknowledgements
    /// in transit.
    pub(super) fn is_acknowledged(&mut self) -> bool {
        std::mem::take(&mut self.acknowledged) || self.has_all_acknowledged(Duration::from_millis(5))
    }

    /// Returns whether everything is acknowledged; a writer for which RustDDS reports an error counts as
    /// acknowledged.
    fn has_all_acknowledged(&self, patience: Duration) -> bool {
        self.writer.wait_for_acknowledgments(patience).unwrap_or(true)
    }

    /// Writes the current samples for the first reader, repeats a report when due, and drops the history of
    /// readers that are gone.
    pub(super) fn settle(&mut self, readers: usize) -> Result<(), TransportError> {
        let joined = readers > std::mem::replace(&mut self.readers, readers);
        if self.has_all_acknowledged(Duration::ZERO) {
            self.acknowledged = true;
            self.history.acknowledged(Instant::now());
        }
        let is_transient = self.durability == Durability::TransientLocal;
        if matches!(self.delivery, Delivery::Once | Delivery::Live) {
            return Ok(());
        }
        if readers == 0 && is_transient {
            return if self.used { self.begin_anew() } else { Ok(()) };
        }
        if self.delivery == Delivery::Log {
            let recent = self.recent.now(Instant::now());
            return match (self.used, recent.is_empty()) {
                (false, _) => self.write(&recent),
                // The samples that RustDDS still holds are too old for a new reader.
                (true, true) if joined => self.begin_anew(),
                (true, _) => Ok(()),
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
        Ok(())
    }

    fn write(&mut self, samples: &[CdrBytes]) -> Result<(), TransportError> {
        for sample in samples {
            if !self.used {
                self.used = true;
                self.first_write = Instant::now();
                self.repeats = 0;
            }
            if self.durability == Durability::TransientLocal {
                self.history.add(Instant::now(), sample.as_ref().len(), self.publications);
            }
            self.writer.write(sample.clone(), Some(Timestamp::now()))?;
        }
        Ok(())
    }
}
