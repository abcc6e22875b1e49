//! Shadow mode: the share of cycles in which the decider agrees with Autoware's own commands.

use std::time::Duration;

use crate::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use gateway_base::time::MonoTime;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CommandDisagreement<T> {
    pub(super) ours: T,
    pub(super) autoware: EnumOrUnknown<T>,
    /// Start of the difference, whatever the commands were.
    pub(super) since: MonoTime,
    /// The difference has lasted longer than is tolerated.
    counts: bool,
}

/// Counts of the cycles compared so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ShadowComparison<T> {
    pub(super) agreed: u64,
    /// Cycles with different commands, within the tolerated time.
    pub(super) tolerated: u64,
    /// Cycles with different commands for longer than is tolerated.
    pub(super) disagreed: u64,
    /// Cycles without two commands to compare.
    pub(super) skipped: u64,
    pub(super) present: Option<CommandDisagreement<T>>,
}

/// A command to show or hide a light.
pub(super) trait ComparableCommand: Copy + PartialEq {
    /// Returns whether the command requests no light: all off, or nothing known.
    fn is_dark(self) -> bool;
}

impl ComparableCommand for TurnCommand {
    fn is_dark(self) -> bool {
        self.side().is_none()
    }
}

impl ComparableCommand for HazardCommand {
    fn is_dark(self) -> bool {
        self != Self::Enable
    }
}

impl<T: ComparableCommand> ShadowComparison<T> {
    /// Compares the commands of one cycle. Two commands without a light are equal: upstream's deciders send
    /// `NO_COMMAND` where this one sends `DISABLE`.
    pub(super) fn compare(
        &mut self,
        ours: T,
        autoware: Option<EnumOrUnknown<T>>,
        tolerance: Duration,
        now: MonoTime,
    ) {
        let before = self.present.take();
        match autoware {
            None => self.skipped += 1,
            Some(EnumOrUnknown::Known(autoware))
                if autoware == ours || autoware.is_dark() && ours.is_dark() =>
            {
                self.agreed += 1;
            }
            Some(autoware) => {
                let since = before.map_or(now, |before| before.since);
                let counts = now.since(since) > tolerance;
                *(if counts { &mut self.disagreed } else { &mut self.tolerated }) += 1;
                self.present = Some(CommandDisagreement { ours, autoware, since, counts });
            }
        }
    }

    /// Returns whether the commands differ for longer than is tolerated.
    pub(super) fn differs(&self) -> bool {
        self.present.is_some_and(|present| present.counts)
    }

    /// Returns the percentage of compared cycles without a counted disagreement; `None` when nothing was
    /// compared.
    #[allow(clippy::cast_precision_loss)] // cycles of a year stay far below 2^52
    pub(super) fn percent(&self) -> Option<f64> {
        let alike = self.agreed + self.tolerated;
        let compared = alike + self.disagreed;
        (compared > 0).then(|| alike as f64 * 100.0 / compared as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use TurnCommand::{Disable, Left, NoCommand, Right};

    #[test]
    fn differences_count_once_they_last() {
        let mut shadow_comparison = ShadowComparison::default();
        let mut at = |ms: u64, ours, autoware: Option<TurnCommand>| {
            let autoware = autoware.map(EnumOrUnknown::Known);
            shadow_comparison.compare(ours, autoware, Duration::from_millis(200), MonoTime::from_millis(ms));
            shadow_comparison
        };
        assert_eq!(at(0, Disable, None).percent(), None);
        at(100, Disable, Some(Disable));
        at(200, Left, Some(Disable));
        assert_eq!(at(400, Left, Some(Disable)).tolerated, 2, "as long as tolerated");
        let late = at(500, Right, Some(Disable));
        assert_eq!((late.disagreed, late.present.unwrap().since), (1, MonoTime::from_millis(200)));
        assert_eq!(late.percent(), Some(75.0));
        let alike = at(600, Right, Some(Right));
        assert_eq!((alike.agreed, alike.present, alike.skipped), (2, None, 1));
        assert!(!at(700, Right, Some(Disable)).present.unwrap().counts, "begins again");
        let dark = at(800, Disable, Some(NoCommand));
        assert_eq!((dark.agreed, dark.present), (3, None), "both ask for no light");
        assert!(at(900, Left, Some(NoCommand)).present.is_some());
    }
}
