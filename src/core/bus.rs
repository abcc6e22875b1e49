//! One CAN bus as the gateway knows it: its link, its signs of life, its losses.

use std::collections::BTreeMap;
use std::time::Duration;

use super::event::LinkState;
use super::frame::CanId;
use super::time::{MonoTime, WallStamp};

/// What the settings say of one bus.
#[derive(Debug, Clone)]
pub struct BusSettings {
    /// Name in the vehicle profile, e.g. `body`.
    pub name: String,
    /// SocketCAN interface, e.g. `can0`; also the name in recordings.
    pub interface: String,
    /// Messages that prove the bus alive beside the bound ones (kernel filters hide all others).
    pub alive_by: Vec<CanId>,
    /// Longest silence of bound and `alive_by` messages on a bus that is awake.
    pub alive_timeout: Duration,
}

/// How long a loss or an error frame keeps the bus at WARN.
pub const LOSS_MEMORY: Duration = Duration::from_secs(10);

/// State and counters of one bus.
#[derive(Debug, Clone)]
pub struct Bus {
    settings: BusSettings,
    link: LinkState,
    last_frame: Option<MonoTime>,
    last_trouble: Option<MonoTime>,
    /// Counts since start.
    pub counts: BusCounts,
}

/// What happened on a bus since start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BusCounts {
    /// Frames of bound and `alive_by` messages.
    pub frames: u64,
    /// Frames the kernel or our own queue dropped.
    pub drops: u64,
    /// Error frames.
    pub error_frames: u64,
    /// Times the link was lost.
    pub link_losses: u64,
    /// Unreadable lines of a recording.
    pub bad_records: u64,
    /// Bits of `CAN_ERR_*` classes seen, with counts.
    pub error_classes: BTreeMap<u32, u64>,
}

/// What is worth saying of a bus, worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusFinding {
    /// The link is not up.
    Link(LinkState),
    /// Link up, but not one frame yet.
    NothingYet,
    /// Link up, but no frame for longer than the bus may be silent.
    Silent,
    /// Frames were dropped, error frames or unreadable lines came, within [`LOSS_MEMORY`].
    Losing,
    /// Receiving.
    Receiving,
}

impl Bus {
    /// A bus that has received nothing.
    pub fn new(settings: BusSettings, link: LinkState) -> Self {
        Self { settings, link, last_frame: None, last_trouble: None, counts: BusCounts::default() }
    }

    /// What the settings say.
    pub fn settings(&self) -> &BusSettings {
        &self.settings
    }

    /// The link as last reported.
    pub fn link(&self) -> LinkState {
        self.link
    }

    /// Takes a new link state; true when frames seen before it no longer count.
    pub fn set_link(&mut self, link: LinkState) -> bool {
        let lost = self.link == LinkState::Up && link != LinkState::Up;
        self.link = link;
        if lost {
            self.counts.link_losses += 1;
            self.last_frame = None;
        }
        lost
    }

    /// A bound or `alive_by` frame arrived; false when it must not be used, because it was still
    /// queued when the link was lost.
    pub fn frame_arrived(&mut self, now: MonoTime) -> bool {
        let up = self.link == LinkState::Up;
        if up {
            self.counts.frames += 1;
            self.last_frame = Some(now);
        }
        up
    }

    /// `count` frames were dropped.
    pub fn dropped(&mut self, count: u32, now: MonoTime) {
        self.counts.drops += u64::from(count);
        self.last_trouble = Some(now);
    }

    /// An error frame came with these `CAN_ERR_*` class bits.
    pub fn error_frame(&mut self, class: u32, now: MonoTime) {
        self.counts.error_frames += 1;
        for bit in (0..32).map(|shift| 1 << shift).filter(|bit| class & bit != 0) {
            *self.counts.error_classes.entry(bit).or_default() += 1;
        }
        self.last_trouble = Some(now);
    }

    /// `count` lines of the recording could not be read.
    pub fn bad_records(&mut self, count: u32, now: MonoTime) {
        self.counts.bad_records += u64::from(count);
        self.last_trouble = Some(now);
    }

    /// Whether the bus shows life: link up and a frame within the limit.
    pub fn is_alive(&self, now: MonoTime) -> bool {
        self.link == LinkState::Up
            && self.last_frame.is_some_and(|last| now.since(last) <= self.settings.alive_timeout)
    }

    /// How long since the last frame; `None` before the first.
    pub fn silence(&self, now: MonoTime) -> Option<Duration> {
        self.last_frame.map(|last| now.since(last))
    }

    /// What is worth saying now.
    pub fn finding(&self, now: MonoTime) -> BusFinding {
        if self.link != LinkState::Up {
            BusFinding::Link(self.link)
        } else if self.last_frame.is_none() {
            BusFinding::NothingYet
        } else if !self.is_alive(now) {
            BusFinding::Silent
        } else if self.last_trouble.is_some_and(|at| now.since(at) <= LOSS_MEMORY) {
            BusFinding::Losing
        } else {
            BusFinding::Receiving
        }
    }

    /// When the finding may change with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let silent = self.last_frame.map(|last| past(last, self.settings.alive_timeout));
        let calm = self.last_trouble.map(|at| past(at, LOSS_MEMORY));
        [silent, calm].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// The first instant at which more than `limit` has passed since `start`.
pub fn past(start: MonoTime, limit: Duration) -> MonoTime {
    start.after(limit.saturating_add(Duration::from_nanos(1)))
}

/// Names of `CAN_ERR_*` class bits (`linux/can/error.h`).
pub fn error_class_name(bit: u32) -> &'static str {
    match bit {
        0x1 => "tx-timeout",
        0x2 => "lost-arbitration",
        0x4 => "controller",
        0x8 => "protocol",
        0x10 => "transceiver",
        0x20 => "no-ack",
        0x40 => "bus-off",
        0x80 => "bus-error",
        0x100 => "restarted",
        0x200 => "counters",
        _ => "other",
    }
}

/// Stamp and monotonic time of the newest of several sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Received {
    /// Decides age and order.
    pub at: MonoTime,
    /// Goes into the message.
    pub stamp: WallStamp,
}

impl Received {
    /// The later one; the first when they came together.
    pub fn newest(self, other: Self) -> Self {
        if other.at > self.at { other } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bus() -> Bus {
        let settings = BusSettings {
            name: "body".into(),
            interface: "can0".into(),
            alive_by: vec![],
            alive_timeout: Duration::from_millis(100),
        };
        Bus::new(settings, LinkState::Missing)
    }

    #[test]
    fn silence_is_told_from_a_lost_link() {
        let mut bus = bus();
        let at = MonoTime::from_millis;
        assert_eq!(bus.finding(at(0)), BusFinding::Link(LinkState::Missing));
        bus.set_link(LinkState::Up);
        assert_eq!(bus.finding(at(0)), BusFinding::NothingYet);
        bus.frame_arrived(at(10));
        assert_eq!(bus.finding(at(110)), BusFinding::Receiving);
        let deadline = bus.next_deadline(at(110)).unwrap();
        assert_eq!(bus.finding(deadline), BusFinding::Silent);
        assert!(bus.set_link(LinkState::Down), "what was seen before no longer counts");
        assert_eq!(bus.finding(deadline), BusFinding::Link(LinkState::Down));
        bus.set_link(LinkState::Up);
        assert_eq!(bus.finding(deadline), BusFinding::NothingYet);
        assert_eq!(bus.counts.link_losses, 1);
    }

    #[test]
    fn a_loss_is_remembered_for_a_while_and_counted_for_ever() {
        let mut bus = bus();
        bus.set_link(LinkState::Up);
        bus.frame_arrived(MonoTime::ZERO);
        bus.dropped(3, MonoTime::ZERO);
        assert_eq!(bus.finding(MonoTime::ZERO), BusFinding::Losing);
        let later = past(MonoTime::ZERO, LOSS_MEMORY);
        bus.frame_arrived(later);
        assert_eq!(bus.finding(later), BusFinding::Receiving);
        assert_eq!(bus.counts.drops, 3);
    }
}
