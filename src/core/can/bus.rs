//! One CAN bus as the gateway knows it: its link, its signs of life, its losses.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::core::can::controller::{Controller, ControllerReport, is_sound};
use crate::core::can::error_frame::{self, ControllerState, ErrorFrame};
use crate::core::can::frame::CanId;
use crate::core::can::link::LinkState;
use crate::core::time::{MonoTime, WallStamp, deadline_after};

/// What the settings say of one bus.
#[derive(Debug, Clone)]
pub struct BusSettings {
    /// Name in the vehicle profile, e.g. `body`.
    pub name: String,
    /// SocketCAN interface, e.g. `can0`; also the name in recordings.
    pub interface: String,
    /// Messages that prove the bus alive beside the bound ones (kernel filters hide all others).
    pub heartbeat_messages: Vec<CanId>,
    /// Longest silence of bound and `heartbeat_messages` messages on a bus that is awake.
    pub alive_timeout: Duration,
    /// Whether the vehicle lets the whole bus fall asleep.
    pub may_sleep: bool,
}

/// How long a loss or an error on the wire keeps the bus at WARN.
pub const LOSS_MEMORY: Duration = Duration::from_secs(10);

/// State and counters of one bus.
#[derive(Debug, Clone)]
pub struct Bus {
    settings: BusSettings,
    link: LinkState,
    controller: Controller,
    last_frame: Option<MonoTime>,
    last_trouble: Option<MonoTime>,
    /// The last sign that silence is not sleep: an error frame, or a controller that is not sound.
    last_unrest: Option<MonoTime>,
    /// When the last frame before the last sleep came.
    fell_asleep: Option<MonoTime>,
    /// Counts since start.
    pub counts: BusCounts,
}

/// What happened on a bus since start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BusCounts {
    /// Frames of bound and `heartbeat_messages` messages.
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

/// What is worth saying of a bus: a change of it is news.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusFinding {
    /// The controller has left the bus, so nothing can come over it.
    BusOff {
        /// Milliseconds to an automatic restart; 0: none. `None`: not told.
        restart_ms: Option<u32>,
    },
    /// The controller does not work, so nothing can come either.
    Stopped,
    /// The controller reports many errors.
    Disturbed(ControllerState, Reception),
    /// Nothing is wrong with the controller, or there is none, or no link to it.
    Sound(Reception),
}

/// What comes over a bus, worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reception {
    /// The link is not up.
    Link(LinkState),
    /// Link up, but not one frame yet.
    NothingYet,
    /// Link up, but no frame for longer than the bus may be silent.
    Silent,
    /// The same on a bus that may sleep, with link and controller sound and no error frame.
    Asleep,
    /// Frames were dropped, error frames or unreadable lines came, within [`LOSS_MEMORY`].
    Losing,
    /// Receiving.
    Receiving,
}

impl Bus {
    /// A bus that has received nothing.
    pub fn new(settings: BusSettings, link: LinkState) -> Self {
        Self {
            settings,
            link,
            controller: Controller::default(),
            last_frame: None,
            last_trouble: None,
            last_unrest: None,
            fell_asleep: None,
            counts: BusCounts::default(),
        }
    }

    /// What the settings say.
    pub fn settings(&self) -> &BusSettings {
        &self.settings
    }

    /// The link as last reported.
    pub fn link(&self) -> LinkState {
        self.link
    }

    /// The controller below.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Takes a new link state; true when frames seen before it no longer count.
    pub fn set_link(&mut self, link: LinkState) -> bool {
        let lost = self.link == LinkState::Up && link != LinkState::Up;
        self.link = link;
        if lost {
            self.counts.link_losses += 1;
            self.last_frame = None;
            self.fell_asleep = None;
            self.controller.forget();
        }
        lost
    }

    /// A bound or `heartbeat_messages` frame arrived; false when it must not be used, because it was still
    /// queued when the link was lost.
    pub fn frame_arrived(&mut self, now: MonoTime) -> bool {
        let up = self.link == LinkState::Up;
        if up {
            self.counts.frames += 1;
            if self.is_asleep(now) {
                self.fell_asleep = self.last_frame;
            }
            self.controller.frame_arrived(now);
            self.last_frame = Some(now);
        }
        up
    }

    /// `count` frames were dropped.
    pub fn dropped(&mut self, count: u32, now: MonoTime) {
        self.counts.drops += u64::from(count);
        self.last_trouble = Some(now);
    }

    /// An error frame came. Without a link it was queued before, and says nothing of the controller.
    pub fn error_frame(&mut self, error: ErrorFrame, now: MonoTime) {
        self.counts.error_frames += 1;
        for bit in error_frame::bits(error.class()) {
            *self.counts.error_classes.entry(bit).or_default() += 1;
        }
        if !error.is_state_alone() {
            self.last_trouble = Some(now);
        }
        if self.link == LinkState::Up {
            self.last_unrest = Some(now);
            self.controller.error_frame(error, now);
        }
    }

    /// The kernel told the controller's state. While the link is not up it says nothing.
    pub fn controller_told(&mut self, report: ControllerReport, now: MonoTime) {
        if self.link == LinkState::Up {
            if !is_sound(self.controller.state()) || !is_sound(Some(report.state)) {
                self.last_unrest = Some(now);
            }
            self.controller.report(report, now);
        }
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

    /// Whether the bus has fallen silent as it may, and nothing says that it is dead instead.
    pub fn is_asleep(&self, now: MonoTime) -> bool {
        let limit = self.settings.alive_timeout;
        let calm = |last: MonoTime| self.last_unrest.is_none_or(|at| last.since(at) > limit);
        self.settings.may_sleep
            && self.link == LinkState::Up
            && is_sound(self.controller.shown(now))
            && self.last_frame.is_some_and(|last| now.since(last) > limit && calm(last))
    }

    /// When the last frame came before the bus fell asleep, now or the last time.
    pub fn fell_asleep(&self, now: MonoTime) -> Option<MonoTime> {
        if self.is_asleep(now) { self.last_frame } else { self.fell_asleep }
    }

    /// What is worth saying now.
    pub fn finding(&self, now: MonoTime) -> BusFinding {
        let reception = self.reception(now);
        match self.controller.shown(now) {
            Some(ControllerState::BusOff) => BusFinding::BusOff { restart_ms: self.controller.restart_ms },
            Some(ControllerState::Stopped) => BusFinding::Stopped,
            Some(
                state @ (ControllerState::Warning | ControllerState::Passive | ControllerState::Restarted),
            ) => BusFinding::Disturbed(state, reception),
            Some(ControllerState::ErrorActive) | None => BusFinding::Sound(reception),
        }
    }

    fn reception(&self, now: MonoTime) -> Reception {
        if self.link != LinkState::Up {
            Reception::Link(self.link)
        } else if self.last_frame.is_none() {
            Reception::NothingYet
        } else if self.is_asleep(now) {
            Reception::Asleep
        } else if !self.is_alive(now) {
            Reception::Silent
        } else if self.last_trouble.is_some_and(|at| now.since(at) <= LOSS_MEMORY) {
            Reception::Losing
        } else {
            Reception::Receiving
        }
    }

    /// When the finding may change with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let silent = self.last_frame.map(|last| deadline_after(last, self.settings.alive_timeout));
        let calm = self.last_trouble.map(|at| deadline_after(at, LOSS_MEMORY));
        let shown = self.controller.next_deadline(now);
        [silent, calm, shown].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// Stamp and monotonic time of the newest of several sources.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
            heartbeat_messages: vec![],
            alive_timeout: Duration::from_millis(100),
            may_sleep: false,
        };
        Bus::new(settings, LinkState::Missing)
    }

    fn sleepy() -> Bus {
        let mut bus = bus();
        bus.settings.may_sleep = true;
        bus.set_link(LinkState::Up);
        bus.frame_arrived(at(10));
        bus
    }

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    fn told(state: ControllerState) -> ControllerReport {
        ControllerReport { state, counters: None, restart_ms: None }
    }

    #[test]
    fn silence_is_told_from_a_lost_link() {
        let mut bus = bus();
        assert_eq!(bus.reception(at(0)), Reception::Link(LinkState::Missing));
        bus.set_link(LinkState::Up);
        assert_eq!(bus.reception(at(0)), Reception::NothingYet);
        bus.frame_arrived(at(10));
        assert_eq!(bus.reception(at(110)), Reception::Receiving);
        let deadline = bus.next_deadline(at(110)).unwrap();
        assert_eq!(bus.reception(deadline), Reception::Silent);
        assert!(bus.set_link(LinkState::Down), "what was seen before no longer counts");
        assert_eq!(bus.reception(deadline), Reception::Link(LinkState::Down));
        bus.set_link(LinkState::Up);
        assert_eq!(bus.reception(deadline), Reception::NothingYet);
        assert_eq!(bus.counts.link_losses, 1);
    }

    #[test]
    fn a_loss_is_remembered_for_a_while_and_counted_for_ever() {
        let mut bus = bus();
        bus.set_link(LinkState::Up);
        bus.frame_arrived(MonoTime::ZERO);
        bus.dropped(3, MonoTime::ZERO);
        assert_eq!(bus.reception(MonoTime::ZERO), Reception::Losing);
        let later = deadline_after(MonoTime::ZERO, LOSS_MEMORY);
        bus.frame_arrived(later);
        assert_eq!(bus.reception(later), Reception::Receiving);
        assert_eq!(bus.counts.drops, 3);
    }

    #[test]
    fn a_bus_that_may_sleep_falls_asleep_and_wakes_up() {
        let mut bus = sleepy();
        assert_eq!((bus.reception(at(110)), bus.fell_asleep(at(110))), (Reception::Receiving, None));
        let deadline = bus.next_deadline(at(110)).unwrap();
        assert_eq!((bus.reception(deadline), bus.fell_asleep(deadline)), (Reception::Asleep, Some(at(10))));
        bus.frame_arrived(at(60_000));
        assert_eq!(bus.reception(at(60_000)), Reception::Receiving);
        assert_eq!(bus.fell_asleep(at(60_000)), Some(at(10)), "what came before is from before the sleep");
    }

    type Death<'a> = (&'a str, &'a dyn Fn(&mut Bus));

    #[test]
    fn a_dead_bus_is_not_asleep() {
        let error_on_the_wire = ErrorFrame::new(0x88, &[]);
        let deaths: [Death<'_>; 7] = [
            ("an error just before", &|bus| {
                bus.error_frame(error_on_the_wire, at(15));
                bus.frame_arrived(at(20));
            }),
            ("an error during the silence", &|bus| bus.error_frame(error_on_the_wire, at(150))),
            ("bus-off", &|bus| bus.error_frame(ErrorFrame::new(0x40, &[]), at(30))),
            ("bus-off and a restart without frames", &|bus| {
                bus.controller_told(told(ControllerState::BusOff), at(30));
                bus.controller_told(told(ControllerState::ErrorActive), at(40));
            }),
            ("error-warning", &|bus| bus.controller_told(told(ControllerState::Warning), at(5_000))),
            ("error-warning that was announced long ago", &|bus| {
                bus.error_frame(ErrorFrame::new(0x204, &[0, 8]), at(15));
                bus.frame_arrived(at(200));
                bus.frame_arrived(at(300));
            }),
            ("a controller that stopped", &|bus| {
                bus.controller_told(told(ControllerState::Stopped), at(30));
            }),
        ];
        for (death, happen) in deaths {
            let mut bus = sleepy();
            happen(&mut bus);
            assert_eq!(bus.reception(at(6_000)), Reception::Silent, "{death}");
            bus.frame_arrived(at(6_000));
            assert_eq!(bus.fell_asleep(at(6_000)), None, "{death}");
        }
        let mut bus = sleepy();
        bus.set_link(LinkState::Down);
        assert_eq!(bus.reception(at(6_000)), Reception::Link(LinkState::Down));
        bus.set_link(LinkState::Up);
        assert_eq!(bus.reception(at(6_000)), Reception::NothingYet);
    }

    #[test]
    fn an_error_long_before_the_last_frame_does_not_keep_a_bus_awake() {
        let mut bus = sleepy();
        bus.error_frame(ErrorFrame::new(0x88, &[]), at(15));
        bus.frame_arrived(at(100));
        bus.frame_arrived(at(116));
        assert_eq!(bus.reception(at(300)), Reception::Asleep);
    }

    #[test]
    fn a_state_that_has_passed_is_no_loss() {
        let mut bus = sleepy();
        bus.error_frame(ErrorFrame::new(0x204, &[0, 0x20, 0, 0, 0, 0, 130, 0]), at(20));
        let passive = BusFinding::Disturbed(ControllerState::Passive, Reception::Receiving);
        assert_eq!(bus.finding(at(20)), passive);
        bus.error_frame(ErrorFrame::new(0x204, &[0, 0x40]), at(2_000));
        bus.frame_arrived(at(2_000));
        assert_eq!(bus.finding(at(2_000)), BusFinding::Sound(Reception::Receiving));
    }
}
