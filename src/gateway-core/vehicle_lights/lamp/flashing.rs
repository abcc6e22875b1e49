//! Flash rate of lamps, as far as frames prove it.

use std::time::Duration;

use crate::vehicle_lights::state::TurnCode;
use gateway_base::time::MonoTime;

/// Frames between which a flash began.
#[derive(Debug, Clone, Copy)]
struct Start {
    last_dark: MonoTime,
    first_lit: MonoTime,
}

#[derive(Debug, Clone, Copy)]
struct Flash {
    start: Start,
    lit: TurnCode,
}

/// Starts of the latest flashes of the same lamps.
#[derive(Debug, Clone, Default)]
pub(super) struct Flashes {
    last_dark: Option<MonoTime>,
    current: Option<Flash>,
    starts: [Option<Start>; STARTS],
    lit: Option<TurnCode>,
}

/// Number of starts compared, which span three whole cycles.
const STARTS: usize = 4;

impl Flashes {
    /// Processes a frame. At the end of a flash, returns its lamps, and whether four successive flashes are
    /// certainly above the limit rather than certainly not; `None` if neither is certain,
    /// because frames are too far apart.
    pub(super) fn frame(&mut self, lit: TurnCode, now: MonoTime, fast: Duration) -> Option<(TurnCode, bool)> {
        if lit == TurnCode::Off {
            self.last_dark = Some(now);
            return self.current.take().and_then(|flash| self.ended(flash, fast));
        }
        if let Some(flash) = &mut self.current {
            if flash.lit != lit {
                flash.lit = TurnCode::Both;
            }
        } else if let Some(last_dark) = self.last_dark {
            self.current = Some(Flash { start: Start { last_dark, first_lit: now }, lit });
        }
        None
    }

    fn ended(&mut self, flash: Flash, fast: Duration) -> Option<(TurnCode, bool)> {
        if self.lit != Some(flash.lit) {
            self.lit = Some(flash.lit);
            self.starts = [None; STARTS];
        }
        self.starts.rotate_left(1);
        self.starts[STARTS - 1] = Some(flash.start);
        let [Some(first), .., Some(last)] = self.starts else { return None };
        let three_fast = fast.saturating_mul(3);
        // The cycles began after the dark frame before the first start and ended after the last dark frame.
        let is_fast = last.first_lit.since(first.last_dark) < three_fast;
        let is_ordinary = last.last_dark.since(first.first_lit) >= three_fast;
        (is_fast || is_ordinary).then_some((flash.lit, is_fast))
    }

    /// Ends the series, so that the next flash starts a new series.
    pub(super) fn end_series(&mut self) {
        self.starts = [None; STARTS];
    }

    /// Discards all frames received so far.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }
}
