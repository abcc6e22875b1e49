//! Injected faults of a channel, as caused by a pipeline or link
//! (docs/spec/traffic-lights.md, "Injected faults").
//!
//! All faults are off by default. The same seed and the same inputs give the same faults. Each kind of fault
//! has its own random draws for each group and message, so that neither other kinds nor other groups affect
//! them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::emission::{Emission, LightsContent};
use draws::{DrawKind, Draws, Spell};
use gateway_base::time::{MonoTime, WallStamp};
use groups::GroupFaults;

mod draws;
mod groups;
mod settings;
#[cfg(test)]
mod tests;

pub use settings::{Confusion, FaultError, FaultSettings, Spells};

/// The active faults of a channel.
#[derive(Debug, Clone)]
pub struct ChannelFaults {
    settings: FaultSettings,
    draws: Draws,
    groups: GroupFaults,
    sent: u64,
    freeze: Spell,
    /// The message that a frozen sender repeats.
    last: Option<Emission>,
    /// Delayed messages with their times of arrival, which never decrease.
    delayed: VecDeque<(MonoTime, Emission)>,
}

impl ChannelFaults {
    /// Creates the faults of a channel without messages.
    pub fn new(settings: FaultSettings) -> Result<Self, FaultError> {
        settings.check()?;
        let draws = Draws::new(settings.seed);
        let (groups, freeze, delayed) = (GroupFaults::new(draws), Spell::default(), VecDeque::new());
        Ok(Self { settings, draws, groups, sent: 0, freeze, last: None, delayed })
    }

    /// Returns the settings of the faults.
    pub fn settings(&self) -> &FaultSettings {
        &self.settings
    }

    /// Processes a message sent at `now`. [`ChannelFaults::poll`] returns it on arrival, unless it is lost.
    pub fn send(&mut self, emission: Emission, now: MonoTime) {
        let message = self.sent;
        self.sent = self.sent.wrapping_add(1);
        let mut emission = self.frozen(emission, message);
        if let LightsContent::Groups(groups) = &emission.content
            && self.settings.change_groups()
        {
            let groups = self.groups.apply(&self.settings, groups, message);
            emission.content = LightsContent::Groups(Arc::new(groups));
        }
        let stamp_ns = emission.stamp.as_nanos().saturating_add(self.settings.stamp_offset_ns);
        emission.stamp = WallStamp::from_nanos(stamp_ns);
        if self.draws.happens(self.settings.loss, DrawKind::Loss, [0, 0], message) {
            return;
        }
        let arrival = now.after(self.latency(message));
        let arrival = self.delayed.back().map_or(arrival, |(before, _)| arrival.max(*before));
        self.delayed.push_back((arrival, emission));
    }

    /// Returns the next message that has arrived by `now`, in sending order. Call it until it returns `None`.
    pub fn poll(&mut self, now: MonoTime) -> Option<Emission> {
        self.next_deadline().filter(|arrival| *arrival <= now)?;
        self.delayed.pop_front().map(|(_, emission)| emission)
    }

    /// Returns the time of arrival of the next message.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.delayed.front().map(|(arrival, _)| *arrival)
    }

    /// Returns the message or, while the sender is frozen, the last message before.
    fn frozen(&mut self, emission: Emission, message: u64) -> Emission {
        let is_frozen = self.freeze.goes_on(self.draws, self.settings.freeze, DrawKind::Freeze, 0, message);
        match &self.last {
            Some(last) if is_frozen => last.clone(),
            _ if self.settings.freeze.probability > 0.0 => self.last.insert(emission).clone(),
            _ => emission,
        }
    }

    fn latency(&self, message: u64) -> Duration {
        let share = self.draws.share(DrawKind::Latency, [0, 0], message);
        let shortest = self.settings.latency.saturating_sub(self.settings.jitter);
        shortest.saturating_add((self.settings.jitter * 2).mul_f64(share))
    }
}
