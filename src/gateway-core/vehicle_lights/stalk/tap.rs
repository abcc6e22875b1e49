//! A lever whose taps are held: comfort flashing after a tap, which the lever's own signal does not show.

use std::time::Duration;

use super::super::state::{StateMachine, TurnCode};
use gateway_base::time::{MonoTime, deadline_after};

/// State machine of a steady signal whose taps are held. A side stays on for at least the hold time from its
/// press, even if the lever is released earlier; the other side, or both, ends it at once. A press whose
/// start was not observed, e.g. after a gap, is not held, since it may have been long.
#[derive(Debug, Clone)]
pub struct TapHold {
    hold: Duration,
    now: MonoTime,
    /// State in the last frame; `None` while it is unknown.
    position: Option<TurnCode>,
    /// Side of the last press, and the last instant of its hold.
    pressed: Option<(TurnCode, MonoTime)>,
}

impl TapHold {
    /// Creates the machine before any frame.
    pub fn new(hold: Duration) -> Self {
        Self { hold, now: MonoTime::ZERO, position: None, pressed: None }
    }

    /// Returns the side that is held beyond its release, with the last instant of its hold.
    fn held(&self) -> Option<(TurnCode, MonoTime)> {
        let is_released = self.position == Some(TurnCode::Off);
        self.pressed.filter(|(_, until)| is_released && self.now <= *until)
    }
}

impl StateMachine for TapHold {
    /// State of the signal itself.
    type Input = TurnCode;
    type State = TurnCode;

    fn observe(&mut self, position: Option<TurnCode>, now: MonoTime) {
        self.advance(now);
        let before = std::mem::replace(&mut self.position, position);
        match position {
            Some(TurnCode::Off) => {}
            Some(side @ (TurnCode::Left | TurnCode::Right)) => {
                if before != Some(side) {
                    self.pressed = before.map(|_| (side, self.now.after(self.hold)));
                }
            }
            Some(TurnCode::Both) | None => self.pressed = None,
        }
    }

    fn advance(&mut self, now: MonoTime) {
        self.now = self.now.max(now);
    }

    fn state(&self) -> Option<TurnCode> {
        let position = self.position?;
        Some(self.held().map_or(position, |(side, _)| side))
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        self.held().map(|(_, until)| deadline_after(until, Duration::ZERO))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::TurnCode::{Both, Left, Off, Right};
    use super::*;

    const HOLD: Duration = Duration::from_secs(2);

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    /// Returns a lever after these positions, each with its time in ms.
    fn after(positions: &[(u64, Option<TurnCode>)]) -> TapHold {
        let mut lever = TapHold::new(HOLD);
        for (ms, position) in positions {
            lever.observe(*position, at(*ms));
        }
        lever
    }

    #[test]
    fn tap_is_held_from_its_press_and_long_press_is_not() {
        let mut lever = after(&[(0, Some(Off)), (1000, Some(Left)), (1300, Some(Off))]);
        let end = deadline_after(at(3000), Duration::ZERO);
        assert_eq!((lever.state(), lever.next_deadline()), (Some(Left), Some(end)));
        lever.advance(at(3000));
        assert_eq!(lever.state(), Some(Left), "for as long as the hold");
        lever.advance(end);
        assert_eq!((lever.state(), lever.next_deadline()), (Some(Off), None));
        let long = after(&[(0, Some(Off)), (1000, Some(Left)), (3001, Some(Off))]);
        assert_eq!(long.state(), Some(Off));
    }

    #[test]
    fn tap_ends_with_the_other_side_both_sides_or_a_gap() {
        let tap = [(0, Some(Off)), (1000, Some(Left)), (1300, Some(Off))];
        for (then, state) in [(Some(Right), Some(Right)), (Some(Both), Some(Off)), (None, Some(Off))] {
            let lever = after(&[&tap[..], &[(1400, then)]].concat());
            assert_eq!(lever.state(), then, "{then:?}");
            let released = after(&[&tap[..], &[(1400, then), (1500, Some(Off))]].concat());
            assert_eq!(released.state(), state, "{then:?} and released");
        }
    }

    #[test]
    fn press_whose_start_was_not_observed_is_not_held() {
        assert_eq!(after(&[(0, Some(Left)), (100, Some(Off))]).state(), Some(Off));
        let gap = [(0, Some(Off)), (100, None), (200, Some(Left)), (300, Some(Off))];
        assert_eq!(after(&gap).state(), Some(Off));
    }

    proptest! {
        /// Against a model that looks at all positions again at every step.
        #[test]
        fn state_agrees_with_model(
            steps in prop::collection::vec(
                (1..1500_u64, prop::sample::select(vec![None, Some(Off), Some(Off), Some(Left), Some(Right), Some(Both)])),
                1..30,
            ),
        ) {
            let mut lever = TapHold::new(HOLD);
            let mut history: Vec<(MonoTime, Option<TurnCode>)> = vec![];
            let mut now = MonoTime::ZERO;
            for (pause, position) in steps {
                now = now.after(Duration::from_millis(pause));
                lever.observe(position, now);
                history.push((now, position));
                let off = history.iter().rev().take_while(|(_, position)| *position == Some(Off)).count();
                let earlier = &history[..history.len() - off];
                let expected = match earlier.last() {
                    Some((_, Some(side @ (Left | Right)))) if off > 0 => {
                        let run = earlier.iter().rev().take_while(|(_, position)| *position == Some(*side)).count();
                        let (start, before) = (earlier.len() - run, earlier.len().checked_sub(run + 1));
                        let is_observed = before.is_some_and(|before| earlier[before].1.is_some());
                        if is_observed && now.since(earlier[start].0) <= HOLD { Some(*side) } else { Some(Off) }
                    }
                    _ => position,
                };
                prop_assert_eq!(lever.state(), expected);
            }
        }
    }
}
