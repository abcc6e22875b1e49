//! The flasher relay, which determines the lamps that are lit.

use std::time::Duration;

use gateway_base::time::MonoTime;
use gateway_core::vehicle_lights::state::{Sides, TurnCode};

/// Flashes one side or both, beginning with a lit lamp.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flasher {
    period: Duration,
    pub(super) code: TurnCode,
    since: MonoTime,
}

impl Flasher {
    /// Creates a flasher that is off. A period of 0 counts as 2 ns, since the relay needs two edges.
    pub(super) fn new(period: Duration) -> Self {
        Self { period: period.max(Duration::from_nanos(2)), code: TurnCode::Off, since: MonoTime::ZERO }
    }

    /// Sets the lights from now on; lights that already flash continue.
    pub(super) fn set(&mut self, code: TurnCode, now: MonoTime) {
        if code != self.code {
            (self.code, self.since) = (code, now);
        }
    }

    /// Returns the sides that are lit; one with a defective bulb flashes at twice the rate.
    pub(super) fn lit(&self, broken: Sides, now: MonoTime) -> Sides {
        let half = self.half(broken).as_nanos();
        let lit = (now.since(self.since).as_nanos() / half).is_multiple_of(2);
        let left = lit && matches!(self.code, TurnCode::Left | TurnCode::Both);
        let right = lit && matches!(self.code, TurnCode::Right | TurnCode::Both);
        Sides { left, right }
    }

    /// Returns the next instant at which [`Self::lit`] changes; `None` while off.
    pub(super) fn next_edge(&self, broken: Sides, now: MonoTime) -> Option<MonoTime> {
        if self.code == TurnCode::Off {
            return None;
        }
        let half = self.half(broken).as_nanos();
        let edges = now.since(self.since).as_nanos() / half + 1;
        let nanos = u64::try_from(edges * half).unwrap_or(u64::MAX);
        Some(self.since.after(Duration::from_nanos(nanos)))
    }

    /// Returns the duration of the lit and of the dark part of a period.
    fn half(&self, broken: Sides) -> Duration {
        let is_fast = match self.code {
            TurnCode::Left => broken.left,
            TurnCode::Right => broken.right,
            // Hazard lights keep their rate, since their load differs.
            TurnCode::Off | TurnCode::Both => false,
        };
        (self.period / if is_fast { 4 } else { 2 }).max(Duration::from_nanos(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Sides = Sides { left: false, right: false };
    const LEFT: Sides = Sides { left: true, right: false };

    #[test]
    fn lamp_is_lit_immediately_and_for_half_of_each_period() {
        let mut flasher = Flasher::new(Duration::from_millis(600));
        let at = MonoTime::from_millis;
        assert_eq!((flasher.lit(NONE, at(0)), flasher.next_edge(NONE, at(0))), (NONE, None));
        flasher.set(TurnCode::Left, at(1000));
        let lit: Vec<_> =
            (1000..2800).step_by(100).map(|ms| u8::from(flasher.lit(NONE, at(ms)).left)).collect();
        assert_eq!(lit, [1, 1, 1, 0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1, 0, 0, 0]);
        assert_eq!(flasher.next_edge(NONE, at(1000)), Some(at(1300)));
        assert_eq!(flasher.next_edge(NONE, at(1299)), Some(at(1300)));
        assert_eq!(flasher.next_edge(NONE, at(1300)), Some(at(1600)));
        flasher.set(TurnCode::Left, at(1500));
        assert_eq!(flasher.next_edge(NONE, at(1500)), Some(at(1600)), "the same lights flash on");
        flasher.set(TurnCode::Both, at(1500));
        assert_eq!(flasher.lit(NONE, at(1500)), Sides { left: true, right: true });
    }

    #[test]
    fn side_with_defective_bulb_flashes_at_twice_the_rate() {
        let mut flasher = Flasher::new(Duration::from_millis(600));
        let at = MonoTime::from_millis;
        for (code, edge) in [(TurnCode::Left, 150), (TurnCode::Right, 300), (TurnCode::Both, 300)] {
            flasher.set(code, at(0));
            assert_eq!(flasher.next_edge(LEFT, at(0)), Some(at(edge)), "{code:?}");
            flasher.set(TurnCode::Off, at(0));
        }
    }
}
