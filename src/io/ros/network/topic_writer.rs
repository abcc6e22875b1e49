//! One topic we write: its writer, what is current on it, and how it is delivered and withdrawn.
//!
//! A reader learns of a new writer some milliseconds after the writer exists. A volatile writer
//! sends it only what comes after that, and a volatile reader need not take what came before. So
//! that a report is not lost on readers which knew the writer's predecessor, it is repeated (same
//! stamp) a few times in the writer's first seconds.
//!
//! RustDDS tidies a transient-local writer's history every 6 s, up to what all readers have
//! acknowledged; without readers it keeps thousands of samples, whatever the depth. A late joiner
//! would be handed minutes of old samples before the current one. So while nobody reads, nothing is
//! written and the history is empty; what is current is written when somebody comes. A stream that
//! others read has seconds of history nonetheless. Handing it over goes at 8 kB each 10 ms, the
//! current sample last; when that would take long, the joiner finds a new, empty writer instead.

use std::time::{Duration, Instant};

use rustdds::dds::result::CreateResult;
use rustdds::{GUID, Publisher, RTPSEntity, Timestamp, Topic};

use super::history::History;
use super::sample::{AsIs, SampleWriter};
use crate::io::ros::link::Delivery;
use crate::io::ros::messages::CdrBytes;
use crate::io::ros::topics::Durability;

/// Times since a writer's first report at which it repeats the current report.
const REPEATS: [Duration; 4] =
    [Duration::from_millis(100), Duration::from_millis(300), Duration::from_secs(1), Duration::from_secs(3)];
/// How long a withdrawal waits for readers to acknowledge what was sent before.
const ACKNOWLEDGE: Duration = Duration::from_millis(100);
/// The most history that a late joiner of a stream is handed.
const MAX_HANDED_OVER: usize = 64 * 1024;
/// The most that a stream's readers may owe acknowledgements for.
const MAX_HISTORY: usize = 256 * 1024 * 1024;
/// How long a new writer is left alone: its readers come one by one.
const SETTLING: Duration = Duration::from_secs(2);

/// A topic of one participant.
pub(super) struct TopicWriter {
    publisher: Publisher,
    topic: Topic,
    durability: Durability,
    delivery: Delivery,
    writer: SampleWriter,
    /// When the writer said something for the first time.
    born: Instant,
    repeats: usize,
    /// What a late joiner is to be told; nothing when withdrawn.
    current: Vec<CdrBytes>,
    /// The writer has said something.
    used: bool,
    history: History,
    /// How many read at the last look.
    readers: usize,
    /// Everything was acknowledged at some moment since that was asked last.
    acknowledged: bool,
}

impl TopicWriter {
    /// A topic on which nothing was said yet; the quality of service is the topic's.
    pub(super) fn new(
        publisher: &Publisher,
        topic: Topic,
        durability: Durability,
        delivery: Delivery,
    ) -> CreateResult<Self> {
        let writer = publisher.create_datawriter_no_key::<CdrBytes, AsIs>(&topic, None)?;
        Ok(Self {
            publisher: publisher.clone(),
            topic,
            durability,
            delivery,
            writer,
            born: Instant::now(),
            repeats: 0,
            current: Vec::new(),
            used: false,
            history: History::default(),
            readers: 0,
            acknowledged: false,
        })
    }

    /// The writer's identity; changes when a report is withdrawn.
    pub(super) fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Publishes, if anybody reads; else the first reader gets it. What is said once goes out
    /// in any case. The error is the text of RustDDS.
    pub(super) fn publish(&mut self, samples: &[CdrBytes], readers: usize) -> Result<(), String> {
        if self.delivery == Delivery::Once {
            return self.write(samples);
        }
        self.current = samples.to_vec();
        if readers > 0 || self.durability == Durability::Volatile { self.write(samples) } else { Ok(()) }
    }

    /// Says nothing from now on, not even to readers that come later. True when that made a new writer.
    pub(super) fn withdraw(&mut self) -> Result<bool, String> {
        if std::mem::take(&mut self.current).is_empty() || self.durability == Durability::Volatile {
            return Ok(false);
        }
        // Readers that do not answer are not waited for any longer: they are gone.
        let _ = self.writer.wait_for_acknowledgments(ACKNOWLEDGE);
        self.begin_anew()
    }

    /// A new writer, which has no history.
    fn begin_anew(&mut self) -> Result<bool, String> {
        let fresh = self.publisher.create_datawriter_no_key::<CdrBytes, AsIs>(&self.topic, None);
        self.writer = fresh.map_err(|error| error.to_string())?;
        self.used = false;
        self.history = History::default();
        Ok(true)
    }

    /// Whether every reader has acknowledged everything, now or at some moment since the last call:
    /// a busy writer seldom has at the very moment it is asked. Waits some milliseconds for what is on
    /// its way.
    pub(super) fn is_acknowledged(&mut self) -> bool {
        std::mem::take(&mut self.acknowledged) || self.has_all_acknowledged(Duration::from_millis(5))
    }

    /// A writer that cannot tell counts as acknowledged.
    fn has_all_acknowledged(&self, patience: Duration) -> bool {
        self.writer.wait_for_acknowledgments(patience).unwrap_or(true)
    }

    /// Says what is current to the first who reads it, and repeats a report when its time has come;
    /// forgets what was said to those who are gone, or was too much for one who comes. True when that
    /// made a new writer.
    pub(super) fn settle(&mut self, readers: usize) -> Result<bool, String> {
        let joined = readers > std::mem::replace(&mut self.readers, readers);
        if self.has_all_acknowledged(Duration::ZERO) {
            self.acknowledged = true;
            self.history.acknowledged(Instant::now());
        }
        let is_transient = self.durability == Durability::TransientLocal;
        if self.delivery == Delivery::Once {
            return Ok(false);
        }
        if readers == 0 && is_transient {
            return if self.used { self.begin_anew() } else { Ok(false) };
        }
        let is_long = is_transient && joined && self.history.bytes() > MAX_HANDED_OVER;
        let is_settled = self.used && self.born.elapsed() >= SETTLING;
        if self.delivery == Delivery::Stream && is_settled {
            let is_too_much = is_long || self.history.bytes() > MAX_HISTORY;
            return if is_too_much { self.begin_anew() } else { Ok(false) };
        }
        let age = self.born.elapsed();
        let due = match self.delivery {
            Delivery::Report => REPEATS.iter().filter(|repeat| **repeat <= age).count(),
            Delivery::Stream | Delivery::Once => self.repeats,
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
                self.born = Instant::now();
                self.repeats = 0;
            }
            if self.delivery == Delivery::Stream {
                self.history.add(Instant::now(), sample.as_ref().len());
            }
            let written = self.writer.write(sample.clone(), Some(Timestamp::now()));
            written.map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}
