//! What was last seen of each bound signal, and whether it may still be believed.

use super::integrity::window::E2eState;
use super::integrity::{IntegrityChecker, IntegrityCounts, IntegrityVerdict, Reject};
use super::meaning::Meaning;
use super::table::{BoundMessage, BoundSignal, MessageIndex, Role, SignalIndex, SignalTable};
use crate::core::can::bus::{Bus, Received};
use crate::core::can::error_frame::ControllerState;
use crate::core::can::frame::Frame;
use crate::core::can::link::{BusIndex, LinkState};
use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};

/// Why there is no value to judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissingReason {
    /// The link below the bus is not up.
    Link(LinkState),
    /// No frame with this signal since start.
    NeverSeen,
    /// None since the link came back or, of an event message, since the bus woke up.
    NotAgain,
    /// The last frame is older than the message's limit.
    Stale,
    /// Frames come, but the last ones did not prove what they must; why, in words.
    NotTrusted(&'static str),
    /// Frames come, but the last one ended before a signal it should carry.
    TooShort,
    /// Frames come, but not those that carry this multiplexed signal.
    NotCarried,
    /// An event message holds as long as its bus is alive, and the bus is silent.
    BusSilent,
    /// The bus's controller is bus-off: nothing can be received.
    BusOff,
    /// The bus fell asleep, as it may, and no frame with this signal has come since.
    BusAsleep,
}

/// One signal, read and judged now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading<T> {
    /// A believable value.
    Observed {
        /// What it means.
        meaning: Meaning<T>,
        /// The raw value.
        raw: i128,
        /// When it came.
        received: Received,
    },
    /// None.
    Missing(MissingReason),
}

/// The last value of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Observation {
    /// Raw value, sign-extended when the DBC says so.
    pub raw: i128,
    /// When its frame came.
    pub received: Received,
}

/// Frames of one bound message since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MessageCounts {
    /// Frames long enough, trusted or not.
    pub frames: u64,
    /// Frames too short for a signal they should carry; none of their signals was used.
    pub too_short: u64,
}

/// What the last frame of a message was.
#[derive(Debug, Clone, Copy)]
enum Latest {
    /// Long enough; when it came.
    Whole(MonoTime),
    /// Not; when it came.
    TooShort(MonoTime),
}

impl Latest {
    fn at(self) -> MonoTime {
        match self {
            Self::Whole(at) | Self::TooShort(at) => at,
        }
    }
}

/// The last value of every bound signal.
#[derive(Debug, Clone)]
pub struct Observations {
    last: Vec<Option<Observation>>,
    counts: Vec<MessageCounts>,
    /// What judges the frames of each message, where something must be proven.
    checkers: Vec<Option<IntegrityChecker>>,
    /// The last rejection of each message, and whether a trusted frame has come since.
    rejected: Vec<Option<(Reject, bool)>>,
    /// The last frame of each message since its link came up.
    latest: Vec<Option<Latest>>,
    /// Signals of each message, by message.
    carried: Vec<Vec<SignalIndex>>,
}

impl Observations {
    /// Nothing seen yet.
    pub fn new(table: &SignalTable) -> Self {
        let carried = (0..table.messages.len())
            .map(|message| {
                let of_message = |signal: &&(usize, &BoundSignal)| signal.1.message == MessageIndex(message);
                let signals: Vec<_> = table.signals.iter().enumerate().collect();
                signals.iter().filter(of_message).map(|(index, _)| SignalIndex(*index)).collect()
            })
            .collect();
        Self {
            last: vec![None; table.signals.len()],
            counts: vec![MessageCounts::default(); table.messages.len()],
            checkers: table
                .messages
                .iter()
                .map(|message| message.integrity.clone().map(IntegrityChecker::new))
                .collect(),
            rejected: vec![None; table.messages.len()],
            latest: vec![None; table.messages.len()],
            carried,
        }
    }

    /// Takes a frame of `message`: all signals it carries, or none when it is too short for one or not
    /// trusted. Says whether it was used.
    pub fn frame_arrived(
        &mut self,
        table: &SignalTable,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) -> bool {
        let (data, length) = (frame.padded(), frame.data().len());
        let carried = &self.carried[message.0];
        let present = |signal: &&SignalIndex| table.signals[signal.0].codec.is_present(data);
        let needed = |signal: &SignalIndex| table.signals[signal.0].codec.needed_length();
        if carried.iter().filter(present).any(|signal| needed(signal) > length) {
            self.counts[message.0].too_short += 1;
            self.latest[message.0] = Some(Latest::TooShort(now.mono));
            return false;
        }
        self.counts[message.0].frames += 1;
        self.latest[message.0] = Some(Latest::Whole(now.mono));
        if let Some(checker) = &mut self.checkers[message.0] {
            match checker.check(frame, now.mono) {
                IntegrityVerdict::Rejected(reject) => {
                    self.rejected[message.0] = Some((reject, false));
                    // What was believed of a message that has become invalid is believed no more.
                    if checker.phase() == Some(E2eState::Invalid) {
                        for signal in carried {
                            self.last[signal.0] = None;
                        }
                    }
                    return false;
                }
                IntegrityVerdict::Trusted => {
                    if let Some((_, trusted_since)) = &mut self.rejected[message.0] {
                        *trusted_since = true;
                    }
                }
            }
        }
        let received = Received { at: now.mono, stamp };
        for signal in carried.iter().filter(present) {
            let raw = table.signals[signal.0].codec.value(data);
            self.last[signal.0] = Some(Observation { raw, received });
        }
        true
    }

    /// Forgets what came over a bus: after a lost link nothing seen before it counts.
    pub fn forget_bus(&mut self, table: &SignalTable, bus: BusIndex) {
        for (slot, signal) in self.last.iter_mut().zip(&table.signals) {
            if table.messages[signal.message.0].bus == bus {
                *slot = None;
            }
        }
        let of_bus = table.messages.iter().map(|message| message.bus == bus);
        let messages = self.checkers.iter_mut().zip(&mut self.rejected).zip(&mut self.latest);
        for (((checker, rejected), latest), of_bus) in messages.zip(of_bus) {
            if of_bus {
                *latest = None;
                checker.iter_mut().for_each(IntegrityChecker::forget);
                *rejected = None;
            }
        }
    }

    /// Forgets the event messages of a bus: a change may have been sent while it was silent, so what
    /// was seen before holds no longer.
    pub fn forget_events(&mut self, table: &SignalTable, bus: BusIndex) {
        for (slot, signal) in self.last.iter_mut().zip(&table.signals) {
            let message = &table.messages[signal.message.0];
            if message.bus == bus && message.timing.is_event() {
                *slot = None;
            }
        }
        for (latest, message) in self.latest.iter_mut().zip(&table.messages) {
            if message.bus == bus && message.timing.is_event() {
                *latest = None;
            }
        }
    }

    /// Reads and judges one signal.
    pub fn read<T: Copy>(
        &self,
        table: &SignalTable,
        role: &Role<T>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Reading<T> {
        match self.believable(table, role.signal, buses, now) {
            Ok(Observation { raw, received }) => {
                Reading::Observed { meaning: role.values.meaning(raw), raw, received }
            }
            Err(why) => Reading::Missing(why),
        }
    }

    /// The last value of a signal as long as it may be believed.
    pub fn believable(
        &self,
        table: &SignalTable,
        signal: SignalIndex,
        buses: &[Bus],
        now: MonoTime,
    ) -> Result<Observation, MissingReason> {
        let index = table.signals[signal.0].message;
        let message = &table.messages[index.0];
        let bus = &buses[usize::from(message.bus.0)];
        let Some(seen) = self.last[signal.0] else {
            let before = self.counts[index.0].frames > 0;
            let none = if before { MissingReason::NotAgain } else { MissingReason::NeverSeen };
            let why = self.shortcoming(table, index, None, now).unwrap_or(none);
            return Err(cause(bus, None, now).unwrap_or(why));
        };
        let last = Some(seen.received.at);
        let stale = message.timing.timeout().is_some_and(|timeout| now.since(seen.received.at) > timeout);
        let absent = if stale {
            Some(self.shortcoming(table, index, last, now).unwrap_or(MissingReason::Stale))
        } else {
            (message.timing.is_event() && !bus.is_alive(now)).then_some(MissingReason::BusSilent)
        };
        absent.map_or(Ok(seen), |why| Err(cause(bus, last, now).unwrap_or(why)))
    }

    /// What is wrong with the frames of a message that come all the same, as it seems to a signal
    /// that was seen last at `last`.
    fn shortcoming(
        &self,
        table: &SignalTable,
        message: MessageIndex,
        last: Option<MonoTime>,
        now: MonoTime,
    ) -> Option<MissingReason> {
        if let Some((reject, false)) = self.rejected[message.0] {
            return Some(MissingReason::NotTrusted(reject.words()));
        }
        let latest = self.latest[message.0]?;
        let silent = |timeout| now.since(latest.at()) > timeout;
        if table.messages[message.0].timing.timeout().is_some_and(silent) {
            return None;
        }
        match latest {
            Latest::TooShort(_) => Some(MissingReason::TooShort),
            Latest::Whole(at) => last.is_none_or(|last| last < at).then_some(MissingReason::NotCarried),
        }
    }

    /// When a signal may go stale with nothing happening. (Event messages: see the bus.)
    pub fn next_deadline(&self, table: &SignalTable, now: MonoTime) -> Option<MonoTime> {
        let stale_at = |(last, signal): (&Option<Observation>, &BoundSignal)| {
            let timeout = table.messages[signal.message.0].timing.timeout()?;
            Some(deadline_after(last.as_ref()?.received.at, timeout))
        };
        let over_at = |(latest, message): (&Option<Latest>, &BoundMessage)| {
            Some(deadline_after(latest.as_ref()?.at(), message.timing.timeout()?))
        };
        let signals = self.last.iter().zip(&table.signals).filter_map(stale_at);
        let messages = self.latest.iter().zip(&table.messages).filter_map(over_at);
        signals.chain(messages).filter(|at| *at > now).min()
    }

    /// The last value of a signal, believable or not.
    pub fn last(&self, signal: SignalIndex) -> Option<Observation> {
        self.last[signal.0]
    }

    /// What the guard of a message has counted; `None` where nothing must be proven.
    pub fn integrity_counts(&self, message: MessageIndex) -> Option<IntegrityCounts> {
        self.checkers[message.0].as_ref().map(IntegrityChecker::counts)
    }

    /// The last frame of a message that was not trusted, since start or the last loss of its link.
    pub fn last_reject(&self, message: MessageIndex) -> Option<Reject> {
        self.rejected[message.0].map(|(reject, _)| reject)
    }

    /// Frames of a message since start.
    pub fn counts(&self, message: MessageIndex) -> MessageCounts {
        self.counts[message.0]
    }
}

/// Why nothing came over a bus since the signal's last frame, if that is known.
fn cause(bus: &Bus, last: Option<MonoTime>, now: MonoTime) -> Option<MissingReason> {
    if bus.link() != LinkState::Up {
        return Some(MissingReason::Link(bus.link()));
    }
    if bus.controller().shown(now) == Some(ControllerState::BusOff) {
        return Some(MissingReason::BusOff);
    }
    let slept = bus.fell_asleep(now).is_some_and(|since| last.is_none_or(|last| last <= since));
    slept.then_some(MissingReason::BusAsleep)
}
