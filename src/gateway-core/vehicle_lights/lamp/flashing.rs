//! Flash rate of lamps, as far as frames prove it.

use std::time::Duration;

use gateway_base::time::MonoTime;

/// Lamps that were lit during a flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lit {
    Left,
    Right,
    Both,
}

/// Flash rate proven by four successive flashes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FlashRate {
    /// Certainly above the limit.
    Fast,
    /// Certainly not above the limit.
    Ordinary,
    /// Unknown, because frames are too far apart.
    Unknown,
}

/// Frames between which a flash began.
#[derive(Debug, Clone, Copy)]
struct Start {
    last_dark: MonoTime,
    first_lit: MonoTime,
}

#[derive(Debug, Clone, Copy)]
struct Flash {
    start: Start,
    lit: Lit,
}

/// Starts of the latest flashes of the same lamps.
#[derive(Debug, Clone, Default)]
pub(super) struct Flashes {
    last_dark: Option<MonoTime>,
    current: Option<Flash>,
    starts: [Option<Start>; STARTS],
    lit: Option<Lit>,
}

/// Number of starts compared, which span three whole cycles.
const STARTS: usize = 4;

impl Flashes {
    /// Processes a frame. At the end of a flash, returns the lamps and their rate; `None` with too few
    /// starts.
    pub(super) fn frame(
        &mut self,
        left: bool,
        right: bool,
        now: MonoTime,
        fast: Duration,
    ) -> Option<(Lit, FlashRate)> {
        let lit = match (left, right) {
            (false, false) => {
                self.last_dark = Some(now);
                return self.current.take().and_then(|flash| self.ended(flash, fast));
            }
            (true, false) => Lit::Left,
            (false, true) => Lit::Right,
            (true, true) => Lit::Both,
        };
        if let Some(flash) = &mut self.current {
            if flash.lit != lit {
                flash.lit = Lit::Both;
            }
        } else if let Some(last_dark) = self.last_dark {
            self.current = Some(Flash { start: Start { last_dark, first_lit: now }, lit });
        }
        None
    }

    fn ended(&mut self, flash: Flash, fast: Duration) -> Option<(Lit, FlashRate)> {
        if self.lit != Some(flash.lit) {
            self.lit = Some(flash.lit);
            self.starts = [None; STARTS];
        }
        self.starts.rotate_left(1);
        self.starts[STARTS - 1] = Some(flash.start);
        let [Some(first), .., Some(last)] = self.starts else { return None };
        let three_fast = fast.saturating_mul(3);
        // The cycles began after the dark frame before the first start and ended after the last dark frame.
        let rate = if last.first_lit.since(first.last_dark) < three_fast {
            FlashRate::Fast
        } else if last.last_dark.since(first.first_lit) >= three_fast {
            FlashRate::Ordinary
        } else {
            FlashRate::Unknown
        };
        Some((flash.lit, rate))
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
