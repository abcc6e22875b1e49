//! How lamps may legally flash, how often a message shows them, and the times that follow.
//!
//! Indicators flash 60 to 120 times a minute (UN R48) and are lit 30 to 75 % of that time, so the
//! longest legal darkness is 0.7 s and the shortest light 0.15 s. Frames see this only now and then:
//! the last lit frame may come one spacing before the light goes out, the next one a spacing after it
//! came back. Between two lit frames lie therefore up to 0.7 s and *two* frame spacings.

use std::time::Duration;

use thiserror::Error;

/// Darkness between two flashes at 60 a minute and 30 % lit: the longest that is legal.
pub const MAX_DARK: Duration = Duration::from_millis(700);
/// A flash at 120 a minute and 30 % lit: the shortest that is legal.
pub const MIN_LIT: Duration = Duration::from_millis(150);
/// Slowest cyclic message accepted: at 120 a minute a lamp lit 40 % of the time still shows in each
/// flash. Ordinary flashers are lit about half the time.
pub const MAX_PERIOD: Duration = Duration::from_millis(200);
/// Both lamps lit this long are not a switch-over any more; shorter than [`MIN_LIT`], so that the
/// first common flash is enough where frames are fast.
const DEFAULT_CONFIRM: Duration = Duration::from_millis(100);
/// First dark after the switch at the latest (UN R48); the longest legal flash is half of it.
const DEFAULT_STUCK_ON_AFTER: Duration = Duration::from_millis(1500);
/// 135 flashes a minute: above the legal 120, below twice any rate from 68 on.
const DEFAULT_FAST_PERIOD: Duration = Duration::from_millis(444);

/// How often a message shows the lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Sent again and again, whatever the lamps do.
    Cyclic {
        /// Time from frame to frame.
        period: Duration,
        /// By how much more two frames may be apart.
        jitter: Duration,
    },
    /// A frame at every change of a lamp: a lit lamp is lit until a frame says otherwise. Slow
    /// repetitions beside it do no harm.
    OnChange {
        /// Longest time from a change to its frame.
        latency: Duration,
    },
}

impl Sampling {
    /// A cyclic message with a tenth of its period as jitter.
    pub fn cyclic(period: Duration) -> Self {
        Self::Cyclic { period, jitter: period / 10 }
    }

    /// Longest time from what a lamp does to the frame that shows it.
    pub fn spacing(self) -> Duration {
        match self {
            Self::Cyclic { period, jitter } => period.saturating_add(jitter),
            Self::OnChange { latency } => latency,
        }
    }

    /// Longest time between two frames that show a legally flashing lamp lit; for a message with
    /// frames further apart than the shortest flash, with one flash fallen between them.
    ///
    /// A hold must be at least this long.
    pub fn longest_unlit(self) -> Duration {
        let spacing = self.spacing();
        let between = MAX_DARK.saturating_add(spacing.saturating_mul(2));
        if spacing <= MIN_LIT || matches!(self, Self::OnChange { .. }) {
            return between;
        }
        // A flash shorter than the spacing can be missed. The slowest such lamp, 30 % lit, has a
        // cycle of spacing / 0.3; its darkness lasts 0.7 cycles, then the missed cycle is added.
        let missed = (spacing.saturating_mul(17) / 3).saturating_add(spacing.saturating_mul(2));
        missed.max(between)
    }

    /// The hold to use when the profile states none: [`Self::longest_unlit`], and in a cyclic message
    /// at least the longest darkness with three spacings, so that one lost frame is bridged.
    ///
    /// A lost frame that was the only one to show its flash is not bridged. At 30 % lit that needs
    /// frames more than 75 ms apart, at 50 % lit more than 125 ms.
    pub fn default_hold(self) -> Duration {
        let one_lost = match self {
            Self::Cyclic { .. } => MAX_DARK.saturating_add(self.spacing().saturating_mul(3)),
            Self::OnChange { .. } => Duration::ZERO,
        };
        self.longest_unlit().max(one_lost)
    }
}

/// How surely a message shows blinking.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// Each legal flash shows in at least one frame.
    EveryFlash,
    /// Flashes shorter than the frame spacing can fall between frames. One at a time is bridged; a
    /// lamp in step with the frames (such as 100 a minute, 30 % lit, in a 200 ms message) can stay
    /// unseen. Worth a warning.
    ShortFlashesMayFallBetween,
}

/// Why blinking cannot be told from being off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Unresolvable {
    /// The message is too slow for any hold.
    #[error(
        "a lamp in a message sent every {period:?} cannot be told from a dark one (at most {MAX_PERIOD:?}): \
         bind a logical or request signal, or a message sent at each change"
    )]
    TooSlow {
        /// Its period.
        period: Duration,
    },
    /// The hold ends within the darkness of a legal flash.
    #[error("a hold of {hold:?} is shorter than the darkness frames may show: at least {needed:?}")]
    HoldTooShort {
        /// The hold.
        hold: Duration,
        /// The least that is accepted.
        needed: Duration,
    },
}

/// Whether a lamp in this message can be turned into a logical state with this hold.
pub fn resolvable(sampling: Sampling, hold: Duration) -> Result<Resolution, Unresolvable> {
    match sampling {
        Sampling::Cyclic { period, .. } if period > MAX_PERIOD => {
            return Err(Unresolvable::TooSlow { period });
        }
        Sampling::Cyclic { .. } | Sampling::OnChange { .. } => {}
    }
    let needed = sampling.longest_unlit();
    if hold < needed {
        return Err(Unresolvable::HoldTooShort { hold, needed });
    }
    let every = sampling.spacing() <= MIN_LIT || matches!(sampling, Sampling::OnChange { .. });
    Ok(if every { Resolution::EveryFlash } else { Resolution::ShortFlashesMayFallBetween })
}

/// Times by which lamps are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LampSettings {
    /// Whether a lit lamp is lit until a frame says otherwise ([`Sampling::OnChange`]).
    pub lit_until_changed: bool,
    /// How long a side stays on after it was last seen lit.
    pub hold: Duration,
    /// How long both lamps must be lit together to mean hazard, and one alone to end it.
    pub confirm: Duration,
    /// Longest time a lamp may be lit without a dark frame.
    pub stuck_on_after: Duration,
    /// A mean flash cycle below this is too fast for an ordinary flasher.
    pub fast_period: Duration,
}

impl LampSettings {
    /// What follows from the law and the message, when the profile states nothing else.
    pub fn for_message(sampling: Sampling) -> Self {
        Self {
            lit_until_changed: matches!(sampling, Sampling::OnChange { .. }),
            hold: sampling.default_hold(),
            confirm: DEFAULT_CONFIRM,
            stuck_on_after: DEFAULT_STUCK_ON_AFTER,
            fast_period: DEFAULT_FAST_PERIOD,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(millis: u64) -> Duration {
        Duration::from_millis(millis)
    }

    #[test]
    fn defaults_follow_from_the_longest_darkness_and_the_frames() {
        let table = [(20, 766), (50, 865), (100, 1030), (130, 1129), (200, 1686)];
        for (period, hold) in table {
            let sampling = Sampling::cyclic(ms(period));
            assert_eq!(sampling.default_hold().as_millis(), hold, "{period} ms");
            assert!(resolvable(sampling, sampling.default_hold()).is_ok(), "{period} ms");
        }
        assert_eq!(Sampling::OnChange { latency: ms(20) }.default_hold(), ms(740));
    }

    #[test]
    fn a_message_too_slow_for_blinking_is_refused_whatever_the_hold() {
        for period in [201, 250, 500, 1000] {
            let refused = resolvable(Sampling::cyclic(ms(period)), ms(60_000));
            assert_eq!(refused, Err(Unresolvable::TooSlow { period: ms(period) }));
        }
    }

    #[test]
    fn a_hold_shorter_than_the_darkness_is_refused_to_the_nanosecond() {
        for sampling in [Sampling::cyclic(ms(100)), Sampling::OnChange { latency: ms(20) }] {
            let needed = sampling.longest_unlit();
            let hold = needed.saturating_sub(Duration::from_nanos(1));
            assert_eq!(resolvable(sampling, hold), Err(Unresolvable::HoldTooShort { hold, needed }));
            assert_eq!(resolvable(sampling, needed), Ok(Resolution::EveryFlash));
        }
    }

    #[test]
    fn frames_further_apart_than_the_shortest_flash_are_worth_a_warning() {
        let of = |period| resolvable(Sampling::cyclic(ms(period)), ms(2000));
        assert_eq!(of(136), Ok(Resolution::EveryFlash));
        assert_eq!(of(137), Ok(Resolution::ShortFlashesMayFallBetween));
    }

    #[test]
    fn no_duration_makes_it_panic() {
        for sampling in [Sampling::cyclic(Duration::MAX), Sampling::OnChange { latency: Duration::MAX }] {
            assert!(sampling.default_hold() >= MAX_DARK);
            assert!(resolvable(sampling, Duration::MAX).is_ok() || sampling.spacing() > MAX_PERIOD);
        }
    }
}
