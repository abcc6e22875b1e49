//! Counters and checksums that a DBC names and a profile does not use.

use std::collections::BTreeSet;

use can_signal::can::{Frame, MAX_DATA};
use can_signal::dbc::codec::SignalCodec;
use can_signal::dbc::model::Message;
use can_signal::validation::integrity::Reject;
use can_signal::validation::integrity::checksum::Checksum;
use can_signal::validation::integrity::counter::{Counter, CounterRule, CounterState};
use can_signal::validation::integrity::search::{FoundChecksum, find_checksum};

/// Number of frames from which a rule counts as proven.
const PROVEN_FRAMES: u64 = 20;
/// Tolerated steps of a counter: up to three lost frames.
const MAX_STEP: u32 = 4;
/// Parts of counters' names in DBCs, in lower case.
const COUNTER_NAMES: [&str; 5] = ["counter", "cnt", "alive", "rolling", "ctr"];
/// Parts of checksums' names in DBCs, in lower case.
const CHECKSUM_NAMES: [&str; 4] = ["checksum", "chksum", "crc", "chk"];
/// Number of different frames used to search for a rule, which must then hold for all others.
const SEARCHED: usize = 64;

/// A counter that the DBC names.
#[derive(Debug, Clone)]
pub(super) struct UnusedCounter {
    signal: String,
    counter: Counter,
    state: CounterState,
    in_sequence: u64,
    others: u64,
}

impl UnusedCounter {
    /// Returns the first signal of a message with a counter's name.
    pub(super) fn of(message: &Message) -> Option<Self> {
        message.signals.iter().find_map(|signal| {
            let is_named = has_name(&signal.name, &COUNTER_NAMES) || signal.name.ends_with("_BZ");
            let counter = if is_named { counter(&signal.codec) } else { None };
            Some(Self {
                signal: signal.name.clone(),
                counter: counter?,
                state: CounterState::default(),
                in_sequence: 0,
                others: 0,
            })
        })
    }

    pub(super) fn frame(&mut self, frame: &Frame) {
        if self.counter.needed_length() > frame.data().len() {
            self.others += 1;
            return;
        }
        match self.state.step(self.counter.rule(), self.counter.value(frame), frame) {
            Ok(_) => self.in_sequence += 1,
            Err(Reject::Initial | Reject::Syncing(_)) => {}
            Err(_) => self.others += 1,
        }
    }

    /// Returns the signal's name, the number of frames in sequence and the tolerated step, if nearly all are
    /// in sequence.
    pub(super) fn holds(&self) -> Option<(&str, u64, u32)> {
        let holds = self.in_sequence >= PROVEN_FRAMES && self.others * 50 <= self.in_sequence;
        holds.then(|| (self.signal.as_str(), self.in_sequence, self.counter.rule().max_step()))
    }
}

fn counter(codec: &SignalCodec) -> Option<Counter> {
    let (lowest, highest) = codec.range();
    let last = u32::try_from(highest).ok().filter(|last| lowest == 0 && (3..=255).contains(last))?;
    let rule =
        CounterRule::new(0, last).and_then(|rule| rule.with_max_step(MAX_STEP.min(last / 2 + 1))).ok()?;
    Counter::new(rule, codec.clone()).ok()
}

/// A checksum that the DBC names.
#[derive(Debug, Clone)]
pub(super) struct UnusedChecksum {
    signal: String,
    codec: SignalCodec,
    /// Different frames until the rule is searched.
    distinct: Vec<Frame>,
    contents: BTreeSet<[u8; MAX_DATA]>,
    found: Option<(FoundChecksum, Checksum)>,
    frames: u64,
    wrong: u64,
}

impl UnusedChecksum {
    /// Returns the first signal of a message with a checksum's name.
    pub(super) fn of(message: &Message) -> Option<Self> {
        let named = message.signals.iter().find(|signal| has_name(&signal.name, &CHECKSUM_NAMES))?;
        Some(Self {
            signal: named.name.clone(),
            codec: named.codec.clone(),
            distinct: Vec::new(),
            contents: BTreeSet::new(),
            found: None,
            frames: 0,
            wrong: 0,
        })
    }

    pub(super) fn frame(&mut self, frame: &Frame) {
        self.frames += 1;
        if let Some((_, checksum)) = &self.found {
            self.wrong += u64::from(!is_right(checksum, frame));
        } else if self.distinct.len() < SEARCHED && self.contents.insert(*frame.padded()) {
            self.distinct.push(*frame);
            if self.distinct.len() == SEARCHED {
                self.found = self.search();
            }
        }
    }

    fn search(&self) -> Option<(FoundChecksum, Checksum)> {
        let found = find_checksum(&self.distinct)?;
        let checksum = Checksum::new(found.rule.clone(), self.codec.clone()).ok()?;
        let holds = self.distinct.iter().all(|frame| is_right(&checksum, frame));
        holds.then_some((found, checksum))
    }

    /// Returns the signal's name, the number of frames and the rule, if it holds for every frame.
    pub(super) fn holds(&self) -> Option<(String, u64, FoundChecksum)> {
        let enough = self.frames >= PROVEN_FRAMES && self.wrong == 0;
        let is_open = self.found.is_none() && self.distinct.len() < SEARCHED;
        let found = if enough && is_open { self.search() } else { self.found.clone() };
        let (found, _) = found.filter(|_| enough)?;
        Some((self.signal.clone(), self.frames, found))
    }
}

fn is_right(checksum: &Checksum, frame: &Frame) -> bool {
    checksum.compare(frame).is_some_and(|(stored, expected)| stored == expected)
}

fn has_name(name: &str, parts: &[&str]) -> bool {
    let name = name.to_lowercase();
    parts.iter().any(|part| name.contains(part))
}
