//! State of one CAN bus: link, silence and losses.

use std::collections::BTreeMap;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::can::controller::{Controller, ControllerReport, is_sound};
use crate::can::error_frame::{self, ControllerState, ErrorFrame};
use crate::can::id_match::IdMatch;
use crate::can::link::LinkState;
use gateway_base::diagnostics::Level;
use gateway_base::names::display_by_name;
use gateway_base::time::{MonoTime, WallStamp, deadline_after};

/// Settings of one bus.
#[derive(Debug, Clone)]
pub struct BusSettings {
    /// Name in the vehicle profile, e.g. `body`.
    pub name: String,
    /// SocketCAN interface, e.g. `can0`; also the name in recordings.
    pub interface: String,
    /// Messages that prove the bus alive in addition to the bound messages; kernel filters hide all other
    /// messages.
    pub heartbeat_messages: Vec<IdMatch>,
    /// Longest silence of bound and heartbeat messages on a bus that is awake.
    pub alive_timeout: Duration,
    /// Longest time after a sleep until all bound messages must be received again.
    pub wake_up_timeout: Duration,
    /// Longest time from the first link after the start until the first frame of each bound message.
    pub start_timeout: Duration,
    /// True if the vehicle may let the whole bus fall asleep.
    pub may_sleep: bool,
}

#[derive(Debug, Clone, Copy)]
struct Sleep {
    /// Receive time of the last frame before the sleep.
    fell_asleep: MonoTime,
    /// Receive time of the first frame after the sleep.
    woke_up: MonoTime,
}

/// Time for which the bus stays at WARN after a loss or an error on the wire.
pub const LOSS_MEMORY: Duration = Duration::from_secs(10);

/// State and counters of one bus.
#[derive(Debug, Clone)]
pub struct Bus {
    settings: BusSettings,
    link: LinkState,
    controller: Controller,
    last_frame: Option<MonoTime>,
    /// Last loss, unreadable record or error on the wire.
    last_disturbance: Option<MonoTime>,
    /// Last error frame or unsound controller state, after which silence is not sleep.
    last_error: Option<MonoTime>,
    last_sleep: Option<Sleep>,
    /// Time at which the first frames began to be awaited: the start, or the first link after it.
    awaited_since: Option<MonoTime>,
    /// Number of events since start, by kind.
    pub counts: BusCounts,
}

/// Number of events on a bus since start.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct BusCounts {
    /// Frames of bound and heartbeat messages. This is not the bus load: kernel filters hide all other
    /// frames.
    pub frames: u64,
    /// Frames dropped by the kernel or by our own queue.
    pub drops: u64,
    /// Error frames of any class.
    pub error_frames: u64,
    /// Number of times the link was lost.
    pub link_losses: u64,
    /// Unreadable records of a recording.
    pub bad_records: u64,
    /// Number of error frames for each `CAN_ERR_*` class bit received.
    pub error_classes: BTreeMap<u32, u64>,
}

/// Condition of a bus; diagnostics are published when it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusFinding {
    /// The link is not up.
    NoLink(LinkState),
    /// The controller has left the bus, so nothing can be received.
    BusOff {
        /// Time to an automatic restart in ms, 0 = manual restart; `None` = unknown.
        restart_ms: Option<u32>,
    },
    /// The controller does not work, so nothing can be received.
    Stopped,
    /// The controller reports many errors.
    Disturbed(ControllerState, BusReception),
    /// The controller is sound, unknown or without a link.
    Sound(BusReception),
}

/// Reception over a bus whose link is up, worst first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BusReception {
    /// The link is up, but no frame has been received yet.
    NothingYet,
    /// The link is up, but no frame has been received within the timeout.
    Silent,
    /// The same on a bus that may sleep, with a sound controller and no error frame.
    Asleep,
    /// Frames were dropped, or error frames or unreadable records received, within [`LOSS_MEMORY`].
    Losing,
    /// Frames are received without losses.
    Receiving,
}

display_by_name!(BusReception);

impl BusReception {
    /// Returns the level of this finding alone.
    pub fn level(self) -> Level {
        match self {
            Self::NothingYet | Self::Silent | Self::Losing => Level::Warn,
            Self::Asleep | Self::Receiving => Level::Ok,
        }
    }
}

impl Bus {
    /// Creates a bus that has received no frame.
    pub fn new(settings: BusSettings, link: LinkState) -> Self {
        Self {
            settings,
            link,
            controller: Controller::default(),
            last_frame: None,
            last_disturbance: None,
            last_error: None,
            last_sleep: None,
            awaited_since: None,
            counts: BusCounts::default(),
        }
    }

    /// Returns the settings of the bus.
    pub fn settings(&self) -> &BusSettings {
        &self.settings
    }

    /// Replaces the settings of the same bus; its history is kept.
    pub fn reconfigure(&mut self, settings: BusSettings) {
        self.settings = settings;
    }

    /// Returns the state of the link as last reported.
    pub fn link(&self) -> LinkState {
        self.link
    }

    /// Returns the controller of the bus.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Sets the link state. Returns `true` if the link was lost; earlier frames then no longer count.
    pub fn set_link(&mut self, link: LinkState) -> bool {
        let lost = self.link == LinkState::Up && link != LinkState::Up;
        self.link = link;
        if lost {
            self.counts.link_losses += 1;
            self.last_frame = None;
            self.last_sleep = None;
            self.controller.forget();
        }
        lost
    }

    /// Begins to await the first frames, unless the link is not up, or that was done before. Call it at the
    /// start, and for each link.
    pub fn await_first_frames(&mut self, now: MonoTime) {
        if self.link == LinkState::Up {
            self.awaited_since.get_or_insert(now);
        }
    }

    /// Returns true while a message that has not been received since the start may still come.
    pub fn is_starting(&self, now: MonoTime) -> bool {
        let is_within = |since| now.is_within(self.settings.start_timeout, since);
        self.link == LinkState::Up && self.awaited_since.is_some_and(is_within)
    }

    /// Records a frame that proves the bus alive. Returns `false` when the frame must not be used, because it
    /// was still queued when the link was lost.
    pub fn frame_arrived(&mut self, now: MonoTime) -> bool {
        let up = self.other_frame_arrived(now);
        if up {
            if let Some(fell_asleep) = self.last_frame.filter(|_| self.is_asleep(now)) {
                self.last_sleep = Some(Sleep { fell_asleep, woke_up: now });
            }
            self.last_frame = Some(now);
        }
        up
    }

    /// Records a frame of a bound message that does not prove the bus alive. Returns the same as
    /// [`Self::frame_arrived`].
    pub fn other_frame_arrived(&mut self, now: MonoTime) -> bool {
        let up = self.link == LinkState::Up;
        if up {
            self.counts.frames += 1;
            self.controller.frame_arrived(now);
        }
        up
    }

    /// Records `count` dropped frames.
    pub fn frames_dropped(&mut self, count: u32, now: MonoTime) {
        self.counts.drops += u64::from(count);
        self.last_disturbance = Some(now);
    }

    /// Records an error frame. While the link is not up, the frame is left over from before and says nothing
    /// about the controller.
    pub fn error_frame(&mut self, error: ErrorFrame, now: MonoTime) {
        self.counts.error_frames += 1;
        for bit in error_frame::bits(error.class) {
            *self.counts.error_classes.entry(bit).or_default() += 1;
        }
        if !error.is_state_alone() {
            self.last_disturbance = Some(now);
        }
        if self.link == LinkState::Up {
            self.last_error = Some(now);
            self.controller.error_frame(error, now);
        }
    }

    /// Records the state of the controller as the kernel reports it; ignored while the link is not up.
    pub fn controller_reported(&mut self, report: ControllerReport, now: MonoTime) {
        if self.link == LinkState::Up {
            if !is_sound(self.controller.state()) || !is_sound(Some(report.state)) {
                self.last_error = Some(now);
            }
            self.controller.report(report, now);
        }
    }

    /// Records `count` unreadable records of a recording.
    pub fn bad_records(&mut self, count: u32, now: MonoTime) {
        self.counts.bad_records += u64::from(count);
        self.last_disturbance = Some(now);
    }

    /// Returns true if the link is up and a frame was received within the timeout.
    #[inline]
    pub fn is_alive(&self, now: MonoTime) -> bool {
        self.link == LinkState::Up
            && self.last_frame.is_some_and(|last| now.is_within(self.settings.alive_timeout, last))
    }

    /// Returns the time since the last frame; `None` before the first.
    pub fn silence(&self, now: MonoTime) -> Option<Duration> {
        self.last_frame.map(|last| now.since(last))
    }

    /// Returns true if the bus is silent, may sleep, and no error suggests that it is dead.
    fn is_asleep(&self, now: MonoTime) -> bool {
        self.permitted_silence(now).is_some_and(|last| now.since(last) > self.settings.alive_timeout)
    }

    /// Returns true if nothing has been received since `since`, and the silence may become a permitted sleep.
    pub fn may_be_falling_asleep(&self, since: MonoTime, now: MonoTime) -> bool {
        self.is_alive(now) && self.permitted_silence(now).is_some_and(|last| last <= since)
    }

    /// Returns the receive time of the last frame if the bus may sleep and no error suggests that it is dead.
    fn permitted_silence(&self, now: MonoTime) -> Option<MonoTime> {
        let limit = self.settings.alive_timeout;
        let undisturbed = |last: &MonoTime| self.last_error.is_none_or(|at| last.since(at) > limit);
        let may_sleep = self.settings.may_sleep && self.link == LinkState::Up;
        let last = self.last_frame.filter(|_| may_sleep).filter(undisturbed);
        last.filter(|_| is_sound(self.controller.shown(now)))
    }

    /// Returns the receive time of the last frame before the current sleep, or before the latest sleep while
    /// messages are still expected to return; `None` otherwise.
    pub fn fell_asleep(&self, now: MonoTime) -> Option<MonoTime> {
        if self.is_asleep(now) {
            return self.last_frame;
        }
        let is_waking = |sleep: &Sleep| now.since(sleep.woke_up) <= self.settings.wake_up_timeout;
        self.last_sleep.filter(is_waking).map(|sleep| sleep.fell_asleep)
    }

    /// Returns the condition of the bus now.
    #[inline]
    pub fn finding(&self, now: MonoTime) -> BusFinding {
        if self.link != LinkState::Up {
            return BusFinding::NoLink(self.link);
        }
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

    fn reception(&self, now: MonoTime) -> BusReception {
        if self.last_frame.is_none() {
            BusReception::NothingYet
        } else if self.is_asleep(now) {
            BusReception::Asleep
        } else if !self.is_alive(now) {
            BusReception::Silent
        } else if self.last_disturbance.is_some_and(|at| now.is_within(LOSS_MEMORY, at)) {
            BusReception::Losing
        } else {
            BusReception::Receiving
        }
    }

    /// Returns the next instant at which [`Self::finding`], [`Self::fell_asleep`] or [`Self::is_starting`]
    /// may change without an event.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let silent = self.last_frame.map(|last| deadline_after(last, self.settings.alive_timeout));
        let loss_forgotten = self.last_disturbance.map(|at| deadline_after(at, LOSS_MEMORY));
        let shown = self.controller.next_deadline(now);
        let awake = self.last_sleep.map(|sleep| deadline_after(sleep.woke_up, self.settings.wake_up_timeout));
        let started = self.awaited_since.map(|since| deadline_after(since, self.settings.start_timeout));
        [silent, loss_forgotten, shown, awake, started].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// Receive time of a frame, monotonic and as a stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReceiveTime {
    /// Monotonic time, which decides age and order.
    pub at: MonoTime,
    /// Stamp for the published message.
    pub stamp: WallStamp,
}

impl ReceiveTime {
    /// Returns the later of the two; `self` when both are equal.
    pub fn newest(self, other: Self) -> Self {
        if other.at > self.at { other } else { self }
    }
}

#[cfg(test)]
mod tests;
