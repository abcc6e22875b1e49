//! Everything that happened on a vehicle's buses.

use can_signal::can::controller::ControllerReport;
use can_signal::can::error_frame::{ControllerState, ErrorFrame};
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::time::WallStamp;
use proptest::prelude::*;

/// One event on a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// A frame: its bus, message and value, and whether it is cut to one byte.
    Frame { bus: u8, id: u16, raw: u8, short: bool },
    /// The link of a bus.
    Link { bus: u8, up: bool },
    /// An error frame, which changes no report.
    Error { bus: u8, class: u32, state: u8 },
    /// The kernel's state of a controller, which changes no report either.
    Controller { bus: u8, report: ControllerReport },
}

/// The buses, and the identifiers of the messages on them; on the other bus each is another message.
pub(crate) const FRONT: u8 = 0;
pub(crate) const REAR: u8 = 1;
pub(crate) const TURN: u16 = 256;
pub(crate) const LEFT: u16 = 257;
pub(crate) const RIGHT: u16 = 258;
pub(crate) const HAZARD: u16 = 256;
pub(crate) const LAMP: u16 = 257;
pub(crate) const ALIVE: u16 = 261;

/// Mostly frames that matter, with values that are defined.
pub(crate) fn any_event() -> impl Strategy<Value = Event> {
    let home = prop_oneof![
        Just((FRONT, TURN)),
        Just((FRONT, LEFT)),
        Just((FRONT, RIGHT)),
        Just((REAR, HAZARD)),
        Just((REAR, LAMP)),
        Just((FRONT, ALIVE)),
        Just((REAR, ALIVE)),
    ];
    let anywhere = (FRONT..=REAR, TURN..=ALIVE + 1);
    let raw = prop_oneof![3 => Just(0), 3 => Just(1), 1 => Just(4), 1 => Just(5), 1 => 0..8_u8];
    let message = prop_oneof![9 => home, 1 => anywhere];
    let short = proptest::bool::weighted(0.04);
    let frame =
        (message, raw, short).prop_map(|((bus, id), raw, short)| Event::Frame { bus, id, raw, short });
    let link = (FRONT..=REAR, proptest::bool::weighted(0.7)).prop_map(|(bus, up)| Event::Link { bus, up });
    let class = prop::sample::select(vec![0x4, 0x204, 0x40, 0x100, 0x88]);
    let bits = prop::sample::select(vec![0x40, 0x08, 0x20, 0x01]);
    let error =
        (FRONT..=REAR, class, bits).prop_map(|(bus, class, state)| Event::Error { bus, class, state });
    let state = prop::sample::select(vec![
        ControllerState::ErrorActive,
        ControllerState::Warning,
        ControllerState::BusOff,
        ControllerState::Stopped,
    ]);
    let controller = (FRONT..=REAR, state, prop::sample::select(vec![None, Some(0), Some(100)])).prop_map(
        |(bus, state, restart_ms)| Event::Controller {
            bus,
            report: ControllerReport { state, counters: None, restart_ms },
        },
    );
    prop_oneof![24 => frame, 1 => link, 2 => error, 1 => controller]
}

impl Event {
    pub(crate) fn input(self, stamp: i64) -> CanInput {
        match self {
            Self::Frame { bus, id, raw, short } => {
                let data = [0xFF, raw | 0xF8];
                let data = if short { &data[..1] } else { &data };
                let frame = Frame::classic(CanId::Standard(id), data).unwrap();
                CanInput::Frame { bus: BusIndex(bus), frame, stamp: WallStamp::from_nanos(stamp) }
            }
            Self::Link { bus, up } => {
                let state = if up { LinkState::Up } else { LinkState::Down };
                CanInput::Link { bus: BusIndex(bus), state }
            }
            Self::Error { bus, class, state } => {
                CanInput::ErrorFrame { bus: BusIndex(bus), error: ErrorFrame::new(class, &[0, state]) }
            }
            Self::Controller { bus, report } => CanInput::Controller { bus: BusIndex(bus), report },
        }
    }
}

/// Everything that happened, in order.
#[derive(Debug, Default)]
pub(crate) struct History {
    entries: Vec<Entry>,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    at_ns: u64,
    stamp: i64,
    event: Event,
}

/// A value with the time and the stamp of its frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Received {
    pub(crate) raw: u8,
    pub(crate) at_ns: u64,
    pub(crate) stamp: i64,
}

impl History {
    /// Notes an event; gives the stamp of its frame, unlike any other.
    pub(crate) fn add(&mut self, at_ns: u64, event: Event) -> i64 {
        let stamp = 7_000_000 + i64::try_from(self.entries.len()).unwrap();
        self.entries.push(Entry { at_ns, stamp, event });
        stamp
    }

    /// Entries of a bus since its link was last lost; `None` while the link is down.
    fn connected(&self, bus: u8, until_ns: u64) -> Option<Vec<&Entry>> {
        let of_bus = |entry: &&Entry| match entry.event {
            Event::Frame { bus: on, .. }
            | Event::Link { bus: on, .. }
            | Event::Error { bus: on, .. }
            | Event::Controller { bus: on, .. } => on == bus,
        };
        let entries: Vec<_> =
            self.entries.iter().filter(of_bus).filter(|entry| entry.at_ns <= until_ns).collect();
        let is_link = |entry: &&Entry| matches!(entry.event, Event::Link { .. });
        let goes_down = |entry: &&Entry| matches!(entry.event, Event::Link { up: false, .. });
        let last_link = entries.iter().rposition(is_link);
        if last_link.is_some_and(|position| goes_down(&entries[position])) {
            return None;
        }
        // After the last "down" came an "up"; what lies between was not received.
        let from = entries.iter().rposition(goes_down).map_or(0, |down| {
            down + entries[down..].iter().position(|entry| is_link(entry) && !goes_down(entry)).unwrap()
        });
        Some(entries[from..].to_vec())
    }

    /// The newest readable value of a message, however old, that no lost link has invalidated.
    pub(crate) fn newest(&self, bus: u8, id: u16, until_ns: u64) -> Option<Received> {
        self.connected(bus, until_ns)?.into_iter().rev().find_map(|entry| match entry.event {
            Event::Frame { id: of, raw, short: false, .. } if of == id => {
                Some(Received { raw, at_ns: entry.at_ns, stamp: entry.stamp })
            }
            Event::Frame { .. } | Event::Link { .. } | Event::Error { .. } | Event::Controller { .. } => None,
        })
    }

    /// True if no readable frame of a message has come since the start.
    pub(crate) fn was_never_received(&self, bus: u8, id: u16, until_ns: u64) -> bool {
        let mut is_up = true;
        let mut readable = self.entries.iter().filter(|entry| entry.at_ns <= until_ns).filter(|entry| {
            match entry.event {
                Event::Link { bus: of, up } if of == bus => is_up = up,
                Event::Frame { bus: on, id: of, short: false, .. } => return is_up && (on, of) == (bus, id),
                Event::Frame { .. } | Event::Link { .. } | Event::Error { .. } | Event::Controller { .. } => {
                }
            }
            false
        });
        readable.next().is_none()
    }

    /// True if nothing but readable frames has come on a bus.
    pub(crate) fn is_calm(&self, bus: u8, until_ns: u64) -> bool {
        let mut entries = self.entries.iter().filter(|entry| entry.at_ns <= until_ns);
        entries.all(|entry| match entry.event {
            Event::Frame { bus: on, short, .. } => on != bus || !short,
            Event::Link { bus: on, .. }
            | Event::Error { bus: on, .. }
            | Event::Controller { bus: on, .. } => on != bus,
        })
    }

    /// True if frames with one of the ids came without a pause longer than the limit.
    pub(crate) fn was_busy(
        &self,
        bus: u8,
        ids: &[u16],
        (from_ns, until_ns): (u64, u64),
        limit_ns: u64,
    ) -> bool {
        let Some(entries) = self.connected(bus, until_ns) else { return false };
        let mut last = from_ns;
        for entry in entries.into_iter().filter(|entry| entry.at_ns >= from_ns) {
            if let Event::Frame { id, .. } = entry.event
                && ids.contains(&id)
            {
                if entry.at_ns - last > limit_ns {
                    return false;
                }
                last = entry.at_ns;
            }
        }
        until_ns - last <= limit_ns
    }
}
