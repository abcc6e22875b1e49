//! States that a source shows over time, and whether a driver can have caused them.

use std::time::Duration;

use gateway_base::time::MonoTime;
use gateway_core::vehicle_lights::state::TurnCode;

/// Minimum duration of a state caused by a driver or a flashing lamp.
const SHORTEST_STATE: Duration = Duration::from_millis(80);
/// Maximum time for which a lamp of a flashing indicator stays lit or dark.
const LONGEST_FLASH: Duration = Duration::from_millis(700);
/// Minimum number of changes that show a rhythm.
const MIN_CHANGES: u64 = 10;

/// State that a source shows in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShownState {
    /// A defined state; on and off of hazard lights are `Both` and `Off`.
    State(TurnCode),
    /// A raw value that the profile does not name.
    Undefined,
    /// A value that means "not available" or a fault.
    Unusable,
}

/// Counts of the states of one source.
#[derive(Debug, Clone, Default)]
pub struct StateHistory {
    /// Number of frames received.
    pub frames: u64,
    /// Number of frames with a value that the profile does not name.
    pub undefined: u64,
    seen: [bool; 4],
    current: Option<(TurnCode, MonoTime)>,
    /// Number of changes from one defined state to another.
    pub changes: u64,
    /// Changes after less than [`SHORTEST_STATE`].
    hasty: u64,
    /// Changes between 80 and 700 ms after the previous one.
    flashes: u64,
    /// Changes from one side to the other without a state in between.
    crossings: u64,
}

/// Behaviour of a source that no driver causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Implausible {
    /// Most states last for less than 80 ms.
    Flickers,
    /// Most states last as long as a flash, although the source should be steady.
    Flashes,
    /// The sides alternate without a pause.
    Crosses,
}

impl StateHistory {
    /// Adds the state that the next frame shows.
    pub(super) fn frame(&mut self, shown: ShownState, now: MonoTime) {
        self.frames += 1;
        let state = match shown {
            ShownState::State(state) => state,
            ShownState::Undefined => {
                self.undefined += 1;
                return;
            }
            ShownState::Unusable => return,
        };
        self.seen[state as usize] = true;
        let Some((before, since)) = self.current else {
            self.current = Some((state, now));
            return;
        };
        if before == state {
            return;
        }
        self.current = Some((state, now));
        self.changes += 1;
        let lasted = now.since(since);
        self.hasty += u64::from(lasted < SHORTEST_STATE);
        self.flashes += u64::from((SHORTEST_STATE..=LONGEST_FLASH).contains(&lasted));
        let sides = [TurnCode::Left, TurnCode::Right];
        self.crossings += u64::from(sides.contains(&before) && sides.contains(&state));
    }

    /// Returns the last defined state; `None` before the first one.
    pub fn current_state(&self) -> Option<TurnCode> {
        self.current.map(|(state, _)| state)
    }

    /// Returns true if a state was shown.
    pub fn has_seen(&self, state: TurnCode) -> bool {
        self.seen[state as usize]
    }

    /// Returns behaviour that no driver causes; `is_lamp` is true for a source that flashes.
    pub fn implausible(&self, is_lamp: bool) -> Option<Implausible> {
        let is_most = |part: u64| self.changes >= MIN_CHANGES && part * 2 > self.changes;
        if is_most(self.hasty) {
            Some(Implausible::Flickers)
        } else if is_most(self.crossings) {
            Some(Implausible::Crosses)
        } else if is_most(self.flashes) && !is_lamp {
            Some(Implausible::Flashes)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the history of states 0 (off), 1 (left), 2 (right) and so on, each for a number of
    /// milliseconds.
    fn states(shown: impl IntoIterator<Item = (TurnCode, u64)>) -> StateHistory {
        let (mut states, mut now) = (StateHistory::default(), 0);
        for (state, millis) in shown {
            states.frame(ShownState::State(state), MonoTime::from_millis(now));
            now += millis;
        }
        states
    }

    fn alternating(one: TurnCode, other: TurnCode, millis: u64) -> StateHistory {
        states((0..24).map(|index| (if index % 2 == 0 { one } else { other }, millis)))
    }

    #[test]
    fn a_driver_is_plausible() {
        use TurnCode::{Left, Off, Right};
        let drive = (0..10).flat_map(|_| [(Off, 4_000), (Left, 3_000), (Off, 900), (Right, 2_000)]);
        assert_eq!(states(drive).implausible(false), None);
    }

    #[test]
    fn rhythms_tell_counters_lamps_and_noise_apart() {
        use TurnCode::{Left, Off, Right};
        assert_eq!(alternating(Off, Left, 20).implausible(false), Some(Implausible::Flickers));
        assert_eq!(alternating(Off, Left, 20).implausible(true), Some(Implausible::Flickers));
        assert_eq!(alternating(Off, Left, 350).implausible(false), Some(Implausible::Flashes));
        assert_eq!(alternating(Off, Left, 350).implausible(true), None);
        assert_eq!(alternating(Left, Right, 1_500).implausible(false), Some(Implausible::Crosses));
        assert_eq!(alternating(Off, Left, 1_500).implausible(false), None);
    }
}
