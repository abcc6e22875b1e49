//! Faults on purpose, as a pipeline or link makes them on a channel
//! (docs/spec/traffic-lights.md, "Faults on purpose").
//!
//! All faults are off by default. The same seed and the same inputs give the same faults. Each kind of fault has
//! its own draws for each group and message, so that neither the other kinds nor the other groups change them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::bulb::Color;
use super::emission::{Emission, LightsContent};
use crate::core::time::{MonoTime, WallStamp};
use draws::{DrawKind, Draws, Spell};
use groups::GroupFaults;

mod draws;
mod groups;
#[cfg(test)]
mod tests;

/// The longest latency and jitter; it bounds the number of delayed messages.
pub const MAX_LATENCY: Duration = Duration::from_secs(60);

/// The faults of a channel; none by default. `config` checks the ranges of single settings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaultSettings {
    /// Seed of the random draws.
    pub seed: u64,
    /// Mean time from sending to arrival, at most [`MAX_LATENCY`].
    pub latency: Duration,
    /// Largest difference of a message's latency from the mean, at most the latency. All values in between are
    /// equally likely. Messages do not overtake each other.
    pub jitter: Duration,
    /// Probability that a message does not arrive.
    pub loss: f64,
    /// Spells in which the sender repeats its last message, stamp included.
    pub freeze: Spells,
    /// Offset that is added to stamps, nanoseconds; stamps of predictions stay.
    pub stamp_offset_ns: i64,
    /// Spells in which a group is missing in messages, independent for each group.
    pub miss: Spells,
    /// Probability that a group is unknown in a message: its colour and status, not its shape.
    pub unknown: f64,
    /// Colours that are taken for others, element by element.
    pub confusions: Vec<Confusion>,
    /// Mean confidence of elements, 0 to 1; `None` keeps their own.
    pub confidence_mean: Option<f64>,
    /// Standard deviation of the confidence; the result is kept within 0 to 1.
    pub confidence_spread: f64,
}

/// A fault that lasts for several messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spells {
    /// Probability that it begins with a message, unless it continues from the one before.
    pub probability: f64,
    /// Mean length in messages, at least 1. At 1 messages are independent of each other.
    pub mean_length: f64,
}

/// A colour that is taken for another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confusion {
    /// The real colour.
    pub from: Color,
    /// The colour that it is taken for.
    pub to: Color,
    /// Probability, 0 to 1. The sum over each real colour is at most 1.
    pub probability: f64,
}

/// Settings that contradict each other.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FaultError {
    /// The confusions of one colour are more probable than 1.
    #[error("confusions of `{}` add up to {sum}; at most 1 is possible", color.name())]
    Confusions {
        /// The real colour.
        color: Color,
        /// The sum of the probabilities.
        sum: f64,
    },
    /// The jitter is larger than the latency, so that a message would arrive before it is sent.
    #[error("the jitter is {jitter:?}; at most the latency, {latency:?}, is possible")]
    Jitter {
        /// The jitter that was set.
        jitter: Duration,
        /// The latency that was set.
        latency: Duration,
    },
}

/// The faults of a channel at work.
#[derive(Debug, Clone)]
pub struct ChannelFaults {
    settings: FaultSettings,
    draws: Draws,
    groups: GroupFaults,
    /// Number of messages that were sent.
    sent: u64,
    freeze: Spell,
    /// The message that a frozen sender repeats.
    last: Option<Emission>,
    /// Delayed messages with their times of arrival, which never decrease.
    delayed: VecDeque<(MonoTime, Emission)>,
}

impl Default for Spells {
    fn default() -> Self {
        Self { probability: 0.0, mean_length: 1.0 }
    }
}

impl ChannelFaults {
    /// Creates the faults of a channel that has sent nothing.
    pub fn new(settings: FaultSettings) -> Result<Self, FaultError> {
        for color in Color::ALL {
            let of_color = settings.confusions.iter().filter(|confusion| confusion.from == color);
            let sum = of_color.map(|confusion| confusion.probability).sum();
            if sum > 1.0 + 1e-9 {
                return Err(FaultError::Confusions { color, sum }); // 0.7 + 0.2 + 0.1 may be more than 1
            }
        }
        if settings.jitter > settings.latency {
            return Err(FaultError::Jitter { jitter: settings.jitter, latency: settings.latency });
        }
        let draws = Draws::new(settings.seed);
        let (groups, freeze, delayed) = (GroupFaults::new(draws), Spell::default(), VecDeque::new());
        Ok(Self { settings, draws, groups, sent: 0, freeze, last: None, delayed })
    }

    /// The settings of the faults.
    pub fn settings(&self) -> &FaultSettings {
        &self.settings
    }

    /// Takes a message that is sent at `now`. [`ChannelFaults::poll`] returns it when it arrives, if it does.
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

    /// The next message that has arrived by `now`, in the order of sending. Call it until it returns `None`.
    pub fn poll(&mut self, now: MonoTime) -> Option<Emission> {
        self.next_deadline().filter(|arrival| *arrival <= now)?;
        self.delayed.pop_front().map(|(_, emission)| emission)
    }

    /// Time of arrival of the next message.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.delayed.front().map(|(arrival, _)| *arrival)
    }

    /// The message, or while the sender is frozen the last one before.
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
