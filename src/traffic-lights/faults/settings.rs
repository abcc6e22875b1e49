//! The settings of faults, and checks for contradictions.

use std::time::Duration;

use crate::bulb::Color;

/// The faults of a channel; none by default. `config` checks the range of each setting.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FaultSettings {
    /// Seed of the random draws.
    pub seed: u64,
    /// Mean time from sending to arrival, at most 60 s.
    pub latency: Duration,
    /// Maximum difference of a message's latency from the mean, at most the latency. All values in between
    /// are equally likely. Messages do not overtake each other.
    pub jitter: Duration,
    /// Probability that a message is lost.
    pub loss: f64,
    /// Spells in which the sender repeats its last message, stamp included.
    pub freeze: Spells,
    /// Offset added to stamps, nanoseconds; stamps of predictions are unchanged.
    pub stamp_offset_ns: i64,
    /// Spells in which a group is missing in messages, independently for each group.
    pub miss: Spells,
    /// Probability that a group is unknown in a message: colour and status, but not shape.
    pub unknown: f64,
    /// Confusions between colours, element by element.
    pub confusions: Vec<Confusion>,
    /// Mean confidence of elements, 0 to 1; `None` leaves it unchanged.
    pub confidence_mean: Option<f64>,
    /// Standard deviation of the confidence; the result is clamped to 0 to 1.
    pub confidence_spread: f64,
}

/// A fault that lasts for several messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spells {
    /// Probability that it begins with a message, unless it continues from the previous message.
    pub probability: f64,
    /// Mean length in messages, at least 1. At 1 messages are independent of each other.
    pub mean_length: f64,
}

/// A colour that is confused with another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confusion {
    /// The actual colour of the light.
    pub from: Color,
    /// The reported colour.
    pub to: Color,
    /// Probability, 0 to 1. The sum for each `from` is at most 1.
    pub probability: f64,
}

/// Contradicting settings.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum FaultError {
    #[error("confusions of `{}` add up to {sum}; at most 1 is possible", color.name())]
    Confusions { color: Color, sum: f64 },
    /// A message would arrive before it is sent.
    #[error("the jitter is {jitter:?}; at most the latency, {latency:?}, is possible")]
    Jitter { jitter: Duration, latency: Duration },
}

impl Default for Spells {
    fn default() -> Self {
        Self { probability: 0.0, mean_length: 1.0 }
    }
}

impl FaultSettings {
    /// Returns whether any fault of groups is on.
    pub(super) fn change_groups(&self) -> bool {
        self.miss.probability > 0.0
            || self.unknown > 0.0
            || !self.confusions.is_empty()
            || self.change_confidence()
    }

    pub(super) fn change_confidence(&self) -> bool {
        self.confidence_mean.is_some() || self.confidence_spread > 0.0
    }

    pub(super) fn check(&self) -> Result<(), FaultError> {
        for color in Color::ALL {
            let of_color = self.confusions.iter().filter(|confusion| confusion.from == color);
            let sum = of_color.map(|confusion| confusion.probability).sum();
            if sum > 1.0 + 1e-9 {
                return Err(FaultError::Confusions { color, sum }); // 0.7 + 0.2 + 0.1 may be more than 1
            }
        }
        if self.jitter > self.latency {
            return Err(FaultError::Jitter { jitter: self.jitter, latency: self.latency });
        }
        Ok(())
    }
}
