//! Faults on purpose: what a pipeline or link makes of a channel
//! (docs/spec/traffic-lights.md, "Faults on purpose").
//!
//! Everything is off unless asked for. The same seed and the same inputs give the same faults, and
//! each kind of fault has its own draws for each group and message: what else is switched on, and
//! which other groups are there, does not change them.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::bulb::Color;
use super::emission::{Content, Emission};
use crate::core::time::{MonoTime, WallStamp};
use draws::{Draws, Kind, Spell};
use groups::GroupFaults;

mod draws;
mod groups;
#[cfg(test)]
mod tests;

/// The longest latency and jitter that can be asked for; it bounds what is under way.
pub const MAX_LATENCY: Duration = Duration::from_secs(60);

/// The faults of a channel; the default is none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaultSettings {
    /// Another seed, other faults.
    pub seed: u64,
    /// Mean time from sending to arrival, at most [`MAX_LATENCY`].
    pub latency: Duration,
    /// Most that the time of a message differs from the mean, either way; every value in between is as
    /// likely. At most the latency. Messages do not overtake each other.
    pub jitter: Duration,
    /// Probability that a message does not arrive.
    pub loss: f64,
    /// The sender repeats its last message, stamp included.
    pub freeze: Spells,
    /// What is added to the stamp, nanoseconds; stamps of predictions stay.
    pub stamp_offset_ns: i64,
    /// A group is missing in messages, each group by itself.
    pub miss: Spells,
    /// Probability that a group is unknown in a message: colour and status, not shape.
    pub unknown: f64,
    /// Colours taken for others, element by element.
    pub confusions: Vec<Confusion>,
    /// Confidence that elements have, 0 to 1; none = as given.
    pub confidence_mean: Option<f64>,
    /// Standard deviation of the confidence; the result is kept within 0 to 1.
    pub confidence_spread: f64,
}

/// Something that goes on for a while, counted in messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spells {
    /// Probability that it begins with a message, if it does not go on from the one before.
    pub probability: f64,
    /// Mean length in messages, at least 1. At 1 no message has to do with another.
    pub mean_length: f64,
}

/// A colour that is taken for another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confusion {
    /// What it is.
    pub from: Color,
    /// What it is taken for.
    pub to: Color,
    /// How often, 0 to 1; for each colour all together at most 1.
    pub probability: f64,
}

/// A setting that means nothing.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FaultError {
    /// No probability, or no confidence.
    #[error("{name} is {found}; from 0 to 1 is possible")]
    Share {
        /// Of what.
        name: &'static str,
        /// As set.
        found: f64,
    },
    /// A spell shorter than a message.
    #[error("{name} lasts {found} messages; at least 1 is possible")]
    Length {
        /// Of what.
        name: &'static str,
        /// As set.
        found: f64,
    },
    /// A spread that is negative or no number.
    #[error("the spread of the confidence is {found}; 0 or more is possible")]
    Spread {
        /// As set.
        found: f64,
    },
    /// The confusions of one colour are more probable than 1.
    #[error("confusions of `{}` add up to {sum}; at most 1 is possible", color.name())]
    Confusions {
        /// Of which colour.
        color: Color,
        /// All together.
        sum: f64,
    },
    /// A message that arrives when nobody waits for it any more.
    #[error("the latency is {found:?}; at most {MAX_LATENCY:?} is possible")]
    Latency {
        /// As set.
        found: Duration,
    },
    /// A message that arrives before it was sent.
    #[error("the jitter is {jitter:?}; at most the latency, {latency:?}, is possible")]
    Jitter {
        /// As set.
        jitter: Duration,
        /// As set.
        latency: Duration,
    },
}

/// The faults of a channel at work.
#[derive(Debug, Clone)]
pub struct Faults {
    settings: FaultSettings,
    draws: Draws,
    groups: GroupFaults,
    /// How many messages were sent.
    sent: u64,
    freeze: Spell,
    /// What a frozen sender repeats.
    last: Option<Emission>,
    /// With the time of arrival, which never falls from one to the next.
    under_way: VecDeque<(MonoTime, Emission)>,
}

impl Default for Spells {
    fn default() -> Self {
        Self { probability: 0.0, mean_length: 1.0 }
    }
}

impl FaultSettings {
    /// Checks the ranges; the error names the first setting that is out of range.
    pub fn check(&self) -> Result<(), FaultError> {
        let shares = [
            ("the probability of loss", self.loss),
            ("the probability of freezing", self.freeze.probability),
            ("the probability of missing a group", self.miss.probability),
            ("the probability of an unknown group", self.unknown),
            ("the mean confidence", self.confidence_mean.unwrap_or_default()),
        ];
        let confusions =
            self.confusions.iter().map(|confusion| ("the probability of a confusion", confusion.probability));
        for (name, found) in shares.into_iter().chain(confusions) {
            if !(0.0..=1.0).contains(&found) {
                return Err(FaultError::Share { name, found });
            }
        }
        for (name, Spells { mean_length: found, .. }) in
            [("a freeze", self.freeze), ("missing a group", self.miss)]
        {
            if !(found >= 1.0 && found.is_finite()) {
                return Err(FaultError::Length { name, found });
            }
        }
        if !(self.confidence_spread >= 0.0 && self.confidence_spread.is_finite()) {
            return Err(FaultError::Spread { found: self.confidence_spread });
        }
        for color in Color::ALL {
            let of_color = self.confusions.iter().filter(|confusion| confusion.from == color);
            let sum = of_color.map(|confusion| confusion.probability).sum();
            if sum > 1.0 + 1e-9 {
                return Err(FaultError::Confusions { color, sum }); // 0.7 + 0.2 + 0.1 may be more than 1
            }
        }
        if self.latency > MAX_LATENCY {
            return Err(FaultError::Latency { found: self.latency });
        }
        if self.jitter > self.latency {
            return Err(FaultError::Jitter { jitter: self.jitter, latency: self.latency });
        }
        Ok(())
    }
}

impl Faults {
    /// Nothing is under way.
    pub fn new(settings: FaultSettings) -> Result<Self, FaultError> {
        settings.check()?;
        let draws = Draws::new(settings.seed);
        let groups = GroupFaults::new(draws, &settings);
        let (freeze, under_way) = (Spell::default(), VecDeque::new());
        Ok(Self { settings, draws, groups, sent: 0, freeze, last: None, under_way })
    }

    /// Takes what is sent at `now`. What becomes of it comes out of [`Faults::poll`].
    pub fn send(&mut self, emission: Emission, now: MonoTime) {
        let message = self.sent;
        self.sent = self.sent.wrapping_add(1);
        let mut emission = self.frozen(emission, message);
        if let Content::Groups(groups) = &emission.content
            && self.groups.is_on()
        {
            emission.content = Content::Groups(Arc::new(self.groups.apply(groups, message)));
        }
        let stamp_ns = emission.stamp.as_nanos().saturating_add(self.settings.stamp_offset_ns);
        emission.stamp = WallStamp::from_nanos(stamp_ns);
        if self.draws.happens(self.settings.loss, Kind::Loss, [0, 0], message) {
            return;
        }
        let arrival = now.after(self.latency(message));
        let arrival = self.under_way.back().map_or(arrival, |(before, _)| arrival.max(*before));
        self.under_way.push_back((arrival, emission));
    }

    /// The next message that has arrived by `now`, in the order of sending; call it until there is
    /// none.
    pub fn poll(&mut self, now: MonoTime) -> Option<Emission> {
        self.next_deadline().filter(|arrival| *arrival <= now)?;
        self.under_way.pop_front().map(|(_, emission)| emission)
    }

    /// When the next message arrives.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.under_way.front().map(|(arrival, _)| *arrival)
    }

    /// The message, or the last one before the sender froze.
    fn frozen(&mut self, emission: Emission, message: u64) -> Emission {
        let is_frozen = self.freeze.goes_on(self.draws, self.settings.freeze, Kind::Freeze, 0, message);
        match &self.last {
            Some(last) if is_frozen => last.clone(),
            _ if self.settings.freeze.probability > 0.0 => self.last.insert(emission).clone(),
            _ => emission,
        }
    }

    fn latency(&self, message: u64) -> Duration {
        let share = self.draws.share(Kind::Latency, [0, 0], message);
        let shortest = self.settings.latency.saturating_sub(self.settings.jitter);
        shortest.saturating_add((self.settings.jitter * 2).mul_f64(share))
    }
}
