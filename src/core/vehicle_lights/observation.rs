//! What was last seen of each bound signal, and whether it may still be believed.

use super::binding::{BoundSignal, LightsBinding, MessageIndex, Role, SignalIndex, Timing};
use super::meaning::Meaning;
use crate::core::bus::{Bus, Received, past};
use crate::core::error_frame::ControllerState;
use crate::core::event::{BusIndex, LinkState};
use crate::core::frame::Frame;
use crate::core::time::{MonoTime, Now, WallStamp};

/// Why there is no value to judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absence {
    /// The link below the bus is not up.
    Link(LinkState),
    /// No frame with this signal since start, since the link came back, or, of an event message,
    /// since the bus woke up.
    NeverSeen,
    /// The last frame is older than the message's limit.
    Stale,
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
    Seen {
        /// What it means.
        meaning: Meaning<T>,
        /// The raw value.
        raw: i128,
        /// When it came.
        received: Received,
    },
    /// None.
    Absent(Absence),
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
    /// Frames used.
    pub frames: u64,
    /// Frames too short for a signal they should carry; none of their signals was used.
    pub too_short: u64,
}

/// The last value of every bound signal.
#[derive(Debug, Clone)]
pub struct Observations {
    last: Vec<Option<Observation>>,
    counts: Vec<MessageCounts>,
    /// Signals of each message, by message.
    carried: Vec<Vec<SignalIndex>>,
}

impl Observations {
    /// Nothing seen yet.
    pub fn new(binding: &LightsBinding) -> Self {
        let carried = (0..binding.messages.len())
            .map(|message| {
                let of_message = |signal: &&(usize, &BoundSignal)| signal.1.message == MessageIndex(message);
                let signals: Vec<_> = binding.signals.iter().enumerate().collect();
                signals.iter().filter(of_message).map(|(index, _)| SignalIndex(*index)).collect()
            })
            .collect();
        Self {
            last: vec![None; binding.signals.len()],
            counts: vec![MessageCounts::default(); binding.messages.len()],
            carried,
        }
    }

    /// Takes a frame of `message`: all signals it carries, or none when it is too short for one.
    pub fn frame_arrived(
        &mut self,
        binding: &LightsBinding,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) {
        let (data, length) = (frame.padded(), frame.data().len());
        let carried = &self.carried[message.0];
        let present = |signal: &&SignalIndex| binding.signals[signal.0].codec.is_present(data);
        let needed = |signal: &SignalIndex| binding.signals[signal.0].codec.needed_length();
        if carried.iter().filter(present).any(|signal| needed(signal) > length) {
            self.counts[message.0].too_short += 1;
            return;
        }
        self.counts[message.0].frames += 1;
        let received = Received { at: now.mono, stamp };
        for signal in carried.iter().filter(present) {
            let raw = binding.signals[signal.0].codec.value(data);
            self.last[signal.0] = Some(Observation { raw, received });
        }
    }

    /// Forgets what came over a bus: after a lost link nothing seen before it counts.
    pub fn forget_bus(&mut self, binding: &LightsBinding, bus: BusIndex) {
        for (slot, signal) in self.last.iter_mut().zip(&binding.signals) {
            if binding.messages[signal.message.0].bus == bus {
                *slot = None;
            }
        }
    }

    /// Forgets the event messages of a bus: a change may have been sent while it was silent, so what
    /// was seen before holds no longer.
    pub fn forget_events(&mut self, binding: &LightsBinding, bus: BusIndex) {
        for (slot, signal) in self.last.iter_mut().zip(&binding.signals) {
            let message = &binding.messages[signal.message.0];
            if message.bus == bus && message.timing == Timing::Event {
                *slot = None;
            }
        }
    }

    /// Reads and judges one signal.
    pub fn read<T: Copy>(
        &self,
        binding: &LightsBinding,
        role: &Role<T>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Reading<T> {
        let message = &binding.messages[binding.signals[role.signal.0].message.0];
        let bus = &buses[usize::from(message.bus.0)];
        let Some(Observation { raw, received }) = self.last[role.signal.0] else {
            return Reading::Absent(cause(bus, None, now).unwrap_or(Absence::NeverSeen));
        };
        let absent = match message.timing {
            Timing::Cyclic { timeout } => (now.since(received.at) > timeout).then_some(Absence::Stale),
            Timing::Event => (!bus.is_alive(now)).then_some(Absence::BusSilent),
        };
        absent.map_or_else(
            || Reading::Seen { meaning: role.values.meaning(raw), raw, received },
            |why| Reading::Absent(cause(bus, Some(received.at), now).unwrap_or(why)),
        )
    }

    /// When a signal may go stale with nothing happening. (Event messages: see the bus.)
    pub fn next_deadline(&self, binding: &LightsBinding, now: MonoTime) -> Option<MonoTime> {
        let stale_at = |(last, signal): (&Option<Observation>, &BoundSignal)| match binding.messages
            [signal.message.0]
            .timing
        {
            Timing::Cyclic { timeout } => last.map(|seen| past(seen.received.at, timeout)),
            Timing::Event => None,
        };
        self.last.iter().zip(&binding.signals).filter_map(stale_at).filter(|at| *at > now).min()
    }

    /// The last value of a signal, believable or not.
    pub fn last(&self, signal: SignalIndex) -> Option<Observation> {
        self.last[signal.0]
    }

    /// Frames of a message since start.
    pub fn counts(&self, message: MessageIndex) -> MessageCounts {
        self.counts[message.0]
    }
}

/// Why nothing came over a bus since the signal's last frame, if that is known.
fn cause(bus: &Bus, last: Option<MonoTime>, now: MonoTime) -> Option<Absence> {
    if bus.link() != LinkState::Up {
        return Some(Absence::Link(bus.link()));
    }
    if bus.controller().shown(now) == Some(ControllerState::BusOff) {
        return Some(Absence::BusOff);
    }
    let slept = bus.fell_asleep(now).is_some_and(|since| last.is_none_or(|last| last <= since));
    slept.then_some(Absence::BusAsleep)
}
