//! The last value of each bound signal, while it is valid.

use std::fmt;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::integrity::window::E2eState;
use super::integrity::{IntegrityChecker, IntegrityCounts, Reject, RejectKind};
use super::senders::{SenderConflict, Senders};
use super::table::{BoundMessage, BoundSignal, MessageIndex, SignalIndex, SignalTable};
use crate::can::{Bus, BusIndex, ControllerState, Frame, LinkState, ReceiveTime, source_address};
use gateway_base::time::{MonoTime, Now, WallStamp, deadline_after};

/// An interruption of a bus, after which some of its values no longer count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interruption {
    /// The link was lost: no value counts.
    LinkLost,
    /// The bus was silent: values of event messages do not count, since a change may have been sent in the
    /// meantime.
    Silence,
}

/// Reason why a signal has no valid value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MissingReason {
    /// The link below the bus is not up.
    Link(LinkState),
    /// No value of this signal has been received since the start, and its first frame is not overdue yet.
    Awaited,
    /// No frame with this signal has been received since start.
    NeverSeen,
    /// No frame has been received since the link came back or, of an event message, since the bus woke up.
    NotAgain,
    /// The last frame is older than the timeout of the message.
    Stale,
    /// Frames arrive, but the last ones were rejected for this reason.
    NotTrusted(RejectKind),
    /// Frames arrive, but the last one ended before a signal it should carry.
    TooShort,
    /// Frames arrive, but the last one was of the other format, classical CAN or CAN FD, than the DBC gives.
    WrongFormat,
    /// Frames of several senders arrive, by the source addresses of two of them, ascending.
    SeveralSenders([u8; 2]),
    /// Frames arrive, but not those that carry this multiplexed signal.
    NotCarried,
    /// The value of an event message holds only while its bus is alive, and the bus is silent.
    BusSilent,
    /// The controller of the bus is bus-off, so nothing can be received.
    BusOff,
    /// The signal is stale, and the bus has been silent for almost as long: it may be falling asleep as
    /// permitted.
    BusQuiet,
    /// The bus fell asleep as permitted, or has just woken up, and no frame with this signal has been
    /// received since.
    BusAsleep,
}

impl MissingReason {
    /// Returns true for a permitted sleep of the bus, which is no failure.
    pub fn is_sleep(self) -> bool {
        matches!(self, Self::BusQuiet | Self::BusAsleep)
    }

    /// Returns true if the first frames of a sound message can also give this reason.
    fn is_usual_at_start(self) -> bool {
        match self {
            Self::NeverSeen | Self::NotCarried => true,
            Self::NotTrusted(reject) => reject.is_usual_at_start(),
            Self::Link(_)
            | Self::Awaited
            | Self::NotAgain
            | Self::Stale
            | Self::TooShort
            | Self::WrongFormat
            | Self::SeveralSenders(_)
            | Self::BusSilent
            | Self::BusOff
            | Self::BusQuiet
            | Self::BusAsleep => false,
        }
    }
}

/// Reason why the signals of a frame are not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unused {
    /// The frame ends before a signal it should carry; its length in bytes.
    TooShort(usize),
    /// The frame has the other format, classical CAN or CAN FD, than the DBC specifies.
    WrongFormat,
    /// Another sender also sends the message; the source addresses of both.
    SeveralSenders([u8; 2]),
    /// The frame fails the integrity check.
    Rejected(Reject),
}

impl Unused {
    /// Returns the reason without the numbers of the frame.
    pub fn reason(self) -> &'static str {
        match self {
            Self::TooShort(_) => "too short for its signals",
            Self::WrongFormat => "classical CAN instead of CAN FD, or the other way round",
            Self::SeveralSenders(_) => "several senders",
            Self::Rejected(reject) => reject.kind().text(),
        }
    }
}

/// Formats the reason with the numbers of the frame.
impl fmt::Display for Unused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooShort(length) => write!(f, "{}: {length} bytes", self.reason()),
            Self::WrongFormat => f.write_str(self.reason()),
            Self::SeveralSenders([one, other]) => {
                write!(f, "{}: source addresses {one:02X} and {other:02X}", self.reason())
            }
            Self::Rejected(reject) => reject.fmt(f),
        }
    }
}

/// Effect of a frame that is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// The frame changes values or their validity.
    News,
    /// The frame repeats valid values; only their receive time changes.
    Repetition,
}

/// The last value of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observation {
    /// Raw value, sign-extended when the signal is signed.
    pub raw: i128,
    /// Receive time of its frame.
    pub received: ReceiveTime,
}

/// Number of frames of one bound message since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MessageCounts {
    /// Frames that were long enough, trusted or not.
    pub frames: u64,
    /// Frames too short for a signal they should carry, whose signals were not used.
    pub too_short: u64,
    /// Frames in a different format from the message's, whose signals were not used.
    pub wrong_format: u64,
}

#[derive(Debug, Clone, Copy)]
struct LatestFrame {
    at: MonoTime,
    /// Reason why none of its signals was used, regardless of their values.
    unusable: Option<MissingReason>,
}

#[derive(Debug, Clone)]
struct MessageState {
    signals: Vec<SignalIndex>,
    counts: MessageCounts,
    /// `None` for a message without integrity rules.
    checker: Option<IntegrityChecker>,
    last_reject: Option<Reject>,
    /// True if a trusted frame has been received since the last rejected frame.
    trusted_since: bool,
    /// The last frame since the link came up.
    latest: Option<LatestFrame>,
    senders: Senders,
}

/// The last value of every bound signal and the state of every bound message.
#[derive(Debug, Clone)]
pub struct Observations {
    last: Vec<Option<Observation>>,
    messages: Vec<MessageState>,
}

impl Observations {
    /// Creates observations before any frame.
    pub fn new(table: &SignalTable) -> Self {
        let carries = |message| {
            let is_carried =
                move |(_, signal): &(usize, &BoundSignal)| signal.message == MessageIndex(message);
            table.signals.iter().enumerate().filter(is_carried).map(|(index, _)| SignalIndex(index)).collect()
        };
        let messages = table.messages.iter().enumerate().map(|(index, message)| MessageState {
            signals: carries(index),
            counts: MessageCounts::default(),
            checker: message.integrity.clone().map(IntegrityChecker::new),
            last_reject: None,
            trusted_since: false,
            latest: None,
            senders: Senders::default(),
        });
        Self { last: vec![None; table.signals.len()], messages: messages.collect() }
    }

    /// Returns observations for another table, with the values of all messages and signals that are also in
    /// `before`.
    ///
    /// A message is the same if its bus, identifiers and format are equal; a signal if its message, name and
    /// codec are equal. A message whose integrity rules differ starts without values, since no frame has been
    /// checked by the new rules.
    #[must_use]
    pub fn carried_over(&self, before: &SignalTable, table: &SignalTable) -> Self {
        let mut carried = Self::new(table);
        let identity = |message: &BoundMessage| (message.bus, message.ids, message.format);
        for (state, message) in carried.messages.iter_mut().zip(&table.messages) {
            let known = before.messages.iter().position(|known| identity(known) == identity(message));
            let Some(known) = known else { continue };
            let was = &self.messages[known];
            state.counts = was.counts;
            if before.messages[known].integrity != message.integrity {
                continue;
            }
            state.checker.clone_from(&was.checker);
            (state.last_reject, state.trusted_since, state.latest, state.senders) =
                (was.last_reject, was.trusted_since, was.latest, was.senders);
            for signal in &state.signals {
                let bound = &table.signals[signal.0];
                let is_same = |other: &BoundSignal| {
                    other.message.0 == known && other.name == bound.name && other.codec == bound.codec
                };
                carried.last[signal.0] =
                    before.signals.iter().position(is_same).and_then(|other| self.last[other]);
            }
        }
        carried
    }

    /// Handles a frame of `message`: uses all signals it carries, or none if it has another format, is too
    /// short for a signal, or is rejected. Returns whether it brings anything new.
    ///
    /// # Errors
    /// Fails with the reason why no signal was used.
    pub fn frame_arrived(
        &mut self,
        table: &SignalTable,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) -> Result<Arrival, Unused> {
        if let Err(SenderConflict(addresses)) = self.sender_arrived(table, message, frame, now.mono) {
            return Err(Unused::SeveralSenders(addresses));
        }
        let (data, length) = (frame.padded(), frame.data().len());
        let MessageState { signals, counts, checker, last_reject, trusted_since, latest, .. } =
            &mut self.messages[message.0];
        let present = |signal: &&SignalIndex| table.signals[signal.0].codec.is_present(data);
        let needed = |signal: &SignalIndex| table.signals[signal.0].codec.needed_length();
        let unusable = if table.messages[message.0].format.is_some_and(|format| format != frame.format()) {
            counts.wrong_format += 1;
            Some((MissingReason::WrongFormat, Unused::WrongFormat))
        } else if signals.iter().filter(present).any(|signal| needed(signal) > length) {
            counts.too_short += 1;
            Some((MissingReason::TooShort, Unused::TooShort(length)))
        } else {
            None
        };
        let timeout = table.messages[message.0].timing.timeout();
        let oldest = timeout.map_or(MonoTime::ZERO, |timeout| now.mono.before(timeout));
        let is_current = |at: MonoTime| at >= oldest;
        let was_usable = latest.is_some_and(|latest| latest.unusable.is_none() && is_current(latest.at));
        let mut is_repetition = was_usable && (checker.is_none() || *trusted_since);
        *latest = Some(LatestFrame { at: now.mono, unusable: unusable.map(|(missing, _)| missing) });
        if let Some((_, unused)) = unusable {
            return Err(unused);
        }
        counts.frames += 1;
        if let Some(checker) = checker {
            let verdict = checker.check(frame, now.mono);
            *trusted_since = verdict.is_ok();
            if let Err(reject) = verdict {
                *last_reject = Some(reject);
                // Earlier values of a message that has become invalid are also no longer valid.
                if checker.e2e_state() == Some(E2eState::Invalid) {
                    for signal in signals.iter() {
                        self.last[signal.0] = None;
                    }
                }
                return Err(Unused::Rejected(reject));
            }
        }
        let received = ReceiveTime { at: now.mono, stamp };
        for signal in signals.iter().filter(present) {
            let raw = table.signals[signal.0].codec.value(data);
            let before = self.last[signal.0].replace(Observation { raw, received });
            is_repetition &= before.is_some_and(|last| last.raw == raw && is_current(last.received.at));
        }
        Ok(if is_repetition { Arrival::Repetition } else { Arrival::News })
    }

    /// Records the sender of a frame whose message may have several senders. While there are two, no value of
    /// the message is valid.
    fn sender_arrived(
        &mut self,
        table: &SignalTable,
        message: MessageIndex,
        frame: &Frame,
        now: MonoTime,
    ) -> Result<(), SenderConflict> {
        let sender =
            source_address(frame.id()).filter(|_| table.messages[message.0].ids.has_several_senders());
        let Some(sender) = sender else { return Ok(()) };
        let state = &mut self.messages[message.0];
        let outcome = state.senders.frame_arrived(sender, now);
        // Counters and values of one sender say nothing about another.
        if outcome != Ok(false) {
            state.begin_again(&mut self.last);
        }
        if outcome.is_err() {
            state.counts.frames += 1;
        }
        outcome.map(drop)
    }

    /// Discards values that do not survive an interruption of their bus.
    pub fn forget(&mut self, table: &SignalTable, bus: BusIndex, by: Interruption) {
        for (state, message) in self.messages.iter_mut().zip(&table.messages) {
            if message.bus != bus {
                continue;
            }
            match by {
                Interruption::LinkLost => {
                    state.begin_again(&mut self.last);
                    state.senders.forget();
                }
                Interruption::Silence if message.timing.is_event() => state.forget(&mut self.last),
                Interruption::Silence => {}
            }
        }
    }

    /// Returns the last value of a signal if it is valid.
    pub fn valid(
        &self,
        table: &SignalTable,
        signal: SignalIndex,
        buses: &[Bus],
        now: MonoTime,
    ) -> Result<Observation, MissingReason> {
        let index = table.signals[signal.0].message;
        let (message, state) = (&table.messages[index.0], &self.messages[index.0]);
        let bus = &buses[usize::from(message.bus.0)];
        let timeout = message.timing.timeout();
        let Some(last) = self.last[signal.0] else {
            let never = state.counts.frames == 0;
            let other = if never { MissingReason::NeverSeen } else { MissingReason::NotAgain };
            let reason = state.rejection(None, timeout, now).unwrap_or(other);
            let is_awaited = bus.is_starting(now) && reason.is_usual_at_start();
            let reason = if is_awaited { MissingReason::Awaited } else { reason };
            return Err(bus_reason(bus, None, now).unwrap_or(reason));
        };
        let last_at = Some(last.received.at);
        let stale_after = timeout.filter(|timeout| !now.is_within(*timeout, last.received.at));
        let reason = if let Some(timeout) = stale_after {
            // If only the sender had failed, other messages would have arrived in the second half of its
            // timeout.
            let is_quiet = bus.may_be_falling_asleep(last.received.at.after(timeout / 2), now);
            let stale = if is_quiet { MissingReason::BusQuiet } else { MissingReason::Stale };
            Some(state.rejection(last_at, Some(timeout), now).unwrap_or(stale))
        } else {
            (message.timing.is_event() && !bus.is_alive(now)).then_some(MissingReason::BusSilent)
        };
        reason.map_or(Ok(last), |reason| Err(bus_reason(bus, last_at, now).unwrap_or(reason)))
    }

    /// Returns the earliest instant after `now` at which a cyclic signal or message becomes stale; `None` if
    /// none will. Event messages depend on the deadline of their bus.
    pub fn next_deadline(&self, table: &SignalTable, now: MonoTime) -> Option<MonoTime> {
        let states = self.messages.iter().zip(&table.messages);
        let timeouts = states.filter_map(|(state, message)| Some((state, message.timing.timeout()?)));
        let deadlines = timeouts.flat_map(|(state, timeout)| {
            let signals = state.signals.iter().filter_map(|signal| Some(self.last[signal.0]?.received.at));
            let latest = state.latest.map(|latest| latest.at);
            signals.chain(latest).map(move |at| deadline_after(at, timeout))
        });
        let senders = self.messages.iter().filter_map(|state| state.senders.next_deadline(now));
        deadlines.chain(senders).filter(|at| *at > now).min()
    }

    /// Returns the last value of a signal, valid or not; `None` when none has been received.
    pub fn last(&self, signal: SignalIndex) -> Option<Observation> {
        self.last[signal.0]
    }

    /// Returns the number of checked frames of a message; `None` if it has no integrity rules.
    pub fn integrity_counts(&self, message: MessageIndex) -> Option<IntegrityCounts> {
        self.messages[message.0].checker.as_ref().map(IntegrityChecker::counts)
    }

    /// Returns the reason for the last rejected frame of a message; `None` when none was rejected since start
    /// or since its link was lost.
    pub fn last_reject(&self, message: MessageIndex) -> Option<Reject> {
        self.messages[message.0].last_reject
    }

    /// Returns true if the last frame of a message passed its integrity check; `None` before the first frame,
    /// or without a check.
    pub fn is_trusted(&self, message: MessageIndex) -> Option<bool> {
        let state = &self.messages[message.0];
        (state.checker.is_some() && state.counts.frames > 0).then_some(state.trusted_since)
    }

    /// Returns the number of frames of a message since start.
    pub fn counts(&self, message: MessageIndex) -> MessageCounts {
        self.messages[message.0].counts
    }
}

impl MessageState {
    /// Forgets everything except the counts, as if no frame had been received from the sender.
    fn begin_again(&mut self, last: &mut [Option<Observation>]) {
        self.forget(last);
        self.last_reject = None;
        if let Some(checker) = &mut self.checker {
            checker.forget();
        }
    }

    fn forget(&mut self, last: &mut [Option<Observation>]) {
        self.latest = None;
        for signal in &self.signals {
            last[signal.0] = None;
        }
    }

    /// Returns the reason why arriving frames give no value to a signal last received at `last`; `None` when
    /// no frames arrive.
    fn rejection(
        &self,
        last: Option<MonoTime>,
        timeout: Option<Duration>,
        now: MonoTime,
    ) -> Option<MissingReason> {
        if let Some(SenderConflict(addresses)) = self.senders.conflict(now) {
            return Some(MissingReason::SeveralSenders(addresses));
        }
        if let Some(reject) = self.last_reject.filter(|_| !self.trusted_since) {
            return Some(MissingReason::NotTrusted(reject.kind()));
        }
        let LatestFrame { at, unusable } = self.latest?;
        if timeout.is_some_and(|timeout| !now.is_within(timeout, at)) {
            return None;
        }
        unusable.or_else(|| last.is_none_or(|last| last < at).then_some(MissingReason::NotCarried))
    }
}

/// Returns the reason, if the bus has one, why nothing has been received since the last frame of a signal.
fn bus_reason(bus: &Bus, last: Option<MonoTime>, now: MonoTime) -> Option<MissingReason> {
    if bus.link() != LinkState::Up {
        return Some(MissingReason::Link(bus.link()));
    }
    if bus.controller().shown(now) == Some(ControllerState::BusOff) {
        return Some(MissingReason::BusOff);
    }
    let slept = bus.fell_asleep(now).is_some_and(|since| last.is_none_or(|last| last <= since));
    slept.then_some(MissingReason::BusAsleep)
}
