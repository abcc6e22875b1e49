//! One report topic: its writer, its current report, and how it is withdrawn.
//!
//! A reader learns of a new writer some milliseconds after the writer exists. A volatile writer
//! sends it only what comes after that, and a volatile reader need not take what came before. So
//! that a report is not lost on readers which knew the writer's predecessor, it is repeated (same
//! stamp) a few times in the writer's first seconds.
//!
//! RustDDS tidies a transient-local writer's history every 6 s, up to what all readers have
//! acknowledged; without readers it keeps thousands of samples, whatever the depth. A late joiner
//! would be handed minutes of old reports before the current one. So while nobody reads, nothing is
//! written and the history is empty; the current report is written when somebody comes.

use std::time::{Duration, Instant};

use rustdds::dds::result::CreateResult;
use rustdds::no_key::DataWriterCdr;
use rustdds::{GUID, Publisher, RTPSEntity, Timestamp, Topic};
use serde::Serialize;

use super::Durability;

/// Times since a writer's first report at which it repeats the current report.
const REPEATS: [Duration; 4] =
    [Duration::from_millis(100), Duration::from_millis(300), Duration::from_secs(1), Duration::from_secs(3)];
/// How long a withdrawal waits for readers to acknowledge what was sent before.
const ACKNOWLEDGE: Duration = Duration::from_millis(100);

/// A report topic of one participant.
pub(super) struct ReportTopic<M: Serialize> {
    publisher: Publisher,
    topic: Topic,
    durability: Durability,
    writer: DataWriterCdr<M>,
    /// When the writer said something for the first time.
    born: Instant,
    repeats: usize,
    current: Option<M>,
    /// The writer has said something.
    used: bool,
}

impl<M: Serialize + Copy> ReportTopic<M> {
    /// A topic on which nothing was said yet; the quality of service is the topic's.
    pub(super) fn new(publisher: &Publisher, topic: Topic, durability: Durability) -> CreateResult<Self> {
        let writer = publisher.create_datawriter_no_key_cdr(&topic, None)?;
        let publisher = publisher.clone();
        Ok(Self {
            publisher,
            topic,
            durability,
            writer,
            born: Instant::now(),
            repeats: 0,
            current: None,
            used: false,
        })
    }

    /// The writer's identity; changes when a report is withdrawn.
    pub(super) fn guid(&self) -> GUID {
        self.writer.guid()
    }

    /// Publishes, if anybody reads; else the first reader gets it. The error is the text of RustDDS.
    pub(super) fn publish(&mut self, report: M, read: bool) -> Result<(), String> {
        self.current = Some(report);
        if read || self.durability == Durability::Volatile { self.write(report) } else { Ok(()) }
    }

    /// Says nothing from now on, not even to readers that come later.
    pub(super) fn withdraw(&mut self) -> Result<(), String> {
        if self.current.take().is_none() || self.durability == Durability::Volatile {
            return Ok(());
        }
        // Readers that do not answer are not waited for any longer: they are gone.
        let _ = self.writer.wait_for_acknowledgments(ACKNOWLEDGE);
        self.begin_anew()
    }

    /// A new writer, which has no history.
    fn begin_anew(&mut self) -> Result<(), String> {
        let fresh = self.publisher.create_datawriter_no_key_cdr(&self.topic, None);
        self.writer = fresh.map_err(|error| error.to_string())?;
        self.used = false;
        Ok(())
    }

    /// Whether every reader has acknowledged everything; waits some milliseconds for it.
    pub(super) fn is_acknowledged(&self) -> bool {
        is_acknowledged(&self.writer)
    }

    /// Says the current report to the first who reads it, and repeats it when its time has come; forgets
    /// what was said to those who are gone. True when that made a new writer.
    pub(super) fn settle(&mut self, read: bool) -> Result<bool, String> {
        if !read && self.durability == Durability::TransientLocal {
            let forgets = self.used;
            return if forgets { self.begin_anew().map(|()| true) } else { Ok(false) };
        }
        let age = self.born.elapsed();
        let due = REPEATS.iter().filter(|repeat| **repeat <= age).count();
        if due > self.repeats || !self.used {
            self.repeats = due;
            self.current.map_or(Ok(()), |report| self.write(report))?;
        }
        Ok(false)
    }

    fn write(&mut self, report: M) -> Result<(), String> {
        if !self.used {
            self.used = true;
            self.born = Instant::now();
            self.repeats = 0;
        }
        self.writer.write(report, Some(Timestamp::now())).map_err(|error| error.to_string())
    }
}

/// Whether every reader has acknowledged everything; waits some milliseconds for what is on its
/// way. A writer that cannot tell counts as acknowledged.
pub(super) fn is_acknowledged<M: Serialize>(writer: &DataWriterCdr<M>) -> bool {
    writer.wait_for_acknowledgments(Duration::from_millis(5)).unwrap_or(true)
}
