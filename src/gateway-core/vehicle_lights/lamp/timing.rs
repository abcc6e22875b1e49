//! Times for the evaluation of lamps, from the legal flash rates and the frames of a message.
//!
//! Indicators flash 60 to 120 times a minute (UN R48) and are lit 30 to 75 % of that time, so the longest
//! legal dark time is 0.7 s and the shortest lit time 0.15 s. Frames sample them: the last lit frame may be
//! sent one spacing before the lamp goes out, and the next lit frame one spacing after the lamp is lit again.
//! Two lit frames are therefore up to 0.7 s plus *two* frame spacings apart.

use std::time::Duration;

use thiserror::Error;

/// Longest legal dark time between two flashes, at 60 a minute and 30 % lit.
pub const MAX_DARK: Duration = Duration::from_millis(700);
/// Shortest legal flash, at 120 a minute and 30 % lit.
pub const MIN_LIT: Duration = Duration::from_millis(150);
/// Longest accepted period of a cyclic message. At 120 a minute it shows each flash of a lamp that is lit
/// 40 % of the time; ordinary lamps are lit about half the time.
pub const MAX_PERIOD: Duration = Duration::from_millis(200);
/// Time for which both lamps must be lit to exclude a change of sides; shorter than [`MIN_LIT`], so with fast
/// frames the first common flash is enough.
const DEFAULT_CONFIRM: Duration = Duration::from_millis(100);
/// Latest end of the first flash after switching on (UN R48); the longest legal flash is half of this.
const DEFAULT_STUCK_ON_AFTER: Duration = Duration::from_millis(1500);
/// Period of 135 flashes a minute, above the legal 120 and below twice any rate of at least 68.
const DEFAULT_FAST_PERIOD: Duration = Duration::from_millis(444);

/// Sampling of the lamps by a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Sent periodically, independently of the lamps.
    Cyclic {
        /// Nominal time between two frames.
        period: Duration,
        /// Largest additional time between two frames.
        jitter: Duration,
    },
    /// Sent at every change of a lamp, so that a lit lamp stays lit until a frame shows it dark. Additional
    /// slow repetitions do no harm.
    OnChange {
        /// Longest time between a change and its frame.
        latency: Duration,
    },
}

impl Sampling {
    /// Creates the sampling of a cyclic message, with a tenth of its period as jitter.
    pub fn cyclic(period: Duration) -> Self {
        Self::Cyclic { period, jitter: period / 10 }
    }

    /// Returns the longest time between a change of a lamp and the frame that shows it.
    pub fn spacing(self) -> Duration {
        match self {
            Self::Cyclic { period, jitter } => period.saturating_add(jitter),
            Self::OnChange { latency } => latency,
        }
    }

    /// Returns the longest time between two frames that show a legally flashing lamp lit; a hold time must
    /// not be shorter. If the spacing exceeds the shortest flash, the time includes one missed flash.
    pub fn longest_unlit(self) -> Duration {
        let spacing = self.spacing();
        let between = MAX_DARK.saturating_add(spacing.saturating_mul(2));
        if spacing <= MIN_LIT || matches!(self, Self::OnChange { .. }) {
            return between;
        }
        // A flash shorter than the spacing can be missed. The slowest such lamp, 30 % lit, has a cycle of
        // spacing / 0.3; its dark time lasts 0.7 cycles, and the missed cycle is added.
        let missed = (spacing.saturating_mul(17) / 3).saturating_add(spacing.saturating_mul(2));
        missed.max(between)
    }

    /// Returns the default hold time: [`Self::longest_unlit`], and for a cyclic message at least the longest
    /// dark time plus three spacings, so that one lost frame is bridged.
    ///
    /// The loss of the only frame that shows a flash is not bridged. This can happen with frames more than 75
    /// ms apart at 30 % lit, and more than 125 ms apart at 50 % lit.
    pub fn default_hold(self) -> Duration {
        let one_lost = match self {
            Self::Cyclic { .. } => MAX_DARK.saturating_add(self.spacing().saturating_mul(3)),
            Self::OnChange { .. } => Duration::ZERO,
        };
        self.longest_unlit().max(one_lost)
    }
}

/// Resolution with which a message shows flashes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resolution {
    /// At least one frame shows each legal flash.
    EveryFlash,
    /// Flashes shorter than the frame spacing can fall between frames. A single missed flash is bridged; a
    /// lamp in step with the frames (such as 100 a minute, 30 % lit, in a 200 ms message) can stay
    /// undetected.
    ShortFlashesMayFallBetween,
}

/// Reason why a flashing lamp cannot be distinguished from a dark lamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Unresolvable {
    /// The message is too slow for any hold time.
    #[error(
        "a flashing lamp in a message sent every {period:?} cannot be distinguished from a dark one; the limit is \
         {MAX_PERIOD:?}"
    )]
    TooSlow {
        /// Period of the message.
        period: Duration,
    },
    /// The hold time is shorter than the dark time that frames may show.
    #[error("a hold of {hold:?} is shorter than the dark time frames may show: at least {needed:?}")]
    HoldTooShort {
        /// Hold time of the profile.
        hold: Duration,
        /// Shortest accepted hold time.
        needed: Duration,
    },
}

/// Checks that a lamp in this message can be evaluated with this hold time.
pub fn resolvable(sampling: Sampling, hold: Duration) -> Result<Resolution, Unresolvable> {
    if let Sampling::Cyclic { period, .. } = sampling
        && period > MAX_PERIOD
    {
        return Err(Unresolvable::TooSlow { period });
    }
    let needed = sampling.longest_unlit();
    if hold < needed {
        return Err(Unresolvable::HoldTooShort { hold, needed });
    }
    let every = sampling.spacing() <= MIN_LIT || matches!(sampling, Sampling::OnChange { .. });
    Ok(if every { Resolution::EveryFlash } else { Resolution::ShortFlashesMayFallBetween })
}

/// Times for the evaluation of lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LampSettings {
    /// True if a lit lamp stays lit until a frame shows it dark ([`Sampling::OnChange`]).
    pub lit_until_changed: bool,
    /// Time for which a side stays on after its last lit frame.
    pub hold: Duration,
    /// Time for which both lamps must be lit to mean hazard, and a single lamp to end it.
    pub confirm: Duration,
    /// Longest time for which a lamp may be lit without a dark frame.
    pub stuck_on_after: Duration,
    /// Average flash period below which a lamp flashes too fast.
    pub fast_period: Duration,
}

impl LampSettings {
    /// Returns defaults for the sampling of the message, from the legal flash rates.
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
    fn default_hold_follows_from_longest_dark_time_and_spacing() {
        let table = [(20, 766), (50, 865), (100, 1030), (130, 1129), (200, 1686)];
        for (period, hold) in table {
            let sampling = Sampling::cyclic(ms(period));
            assert_eq!(sampling.default_hold().as_millis(), hold, "{period} ms");
            assert!(resolvable(sampling, sampling.default_hold()).is_ok(), "{period} ms");
        }
        assert_eq!(Sampling::OnChange { latency: ms(20) }.default_hold(), ms(740));
    }

    #[test]
    fn message_too_slow_for_flashes_is_refused_with_any_hold() {
        for period in [201, 250, 500, 1000] {
            let refused = resolvable(Sampling::cyclic(ms(period)), ms(60_000));
            assert_eq!(refused, Err(Unresolvable::TooSlow { period: ms(period) }));
        }
    }

    #[test]
    fn hold_shorter_than_dark_time_is_refused() {
        for sampling in [Sampling::cyclic(ms(100)), Sampling::OnChange { latency: ms(20) }] {
            let needed = sampling.longest_unlit();
            let hold = needed.saturating_sub(Duration::from_nanos(1));
            assert_eq!(resolvable(sampling, hold), Err(Unresolvable::HoldTooShort { hold, needed }));
            assert_eq!(resolvable(sampling, needed), Ok(Resolution::EveryFlash));
        }
    }

    #[test]
    fn spacing_above_shortest_flash_may_miss_flashes() {
        let of = |period| resolvable(Sampling::cyclic(ms(period)), ms(2000));
        assert_eq!(of(136), Ok(Resolution::EveryFlash));
        assert_eq!(of(137), Ok(Resolution::ShortFlashesMayFallBetween));
    }

    #[test]
    fn any_duration_is_checked_without_panic() {
        for sampling in [Sampling::cyclic(Duration::MAX), Sampling::OnChange { latency: Duration::MAX }] {
            assert!(sampling.default_hold() >= MAX_DARK);
            assert!(resolvable(sampling, Duration::MAX).is_ok() || sampling.spacing() > MAX_PERIOD);
        }
    }
}
