//! How fast lamps flash, as far as frames can prove it.

use std::time::Duration;

use crate::core::time::MonoTime;

/// Which lamps a flash showed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lit {
    Left,
    Right,
    Both,
}

/// What four flashes in a row prove.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pace {
    /// Surely faster than the limit.
    Fast,
    /// Surely not.
    Ordinary,
    /// Frames are too far apart to say.
    Unproven,
}

/// The frames between which a flash began.
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

/// Starts of the last flashes of the same lamps.
#[derive(Debug, Clone, Default)]
pub(super) struct Flashes {
    last_dark: Option<MonoTime>,
    current: Option<Flash>,
    starts: [Option<Start>; STARTS],
    lit: Option<Lit>,
}

/// Starts compared: three whole cycles.
const STARTS: usize = 4;

impl Flashes {
    /// Takes a frame. At the end of a flash that makes the starts complete, says what they prove.
    pub(super) fn frame(
        &mut self,
        left: bool,
        right: bool,
        now: MonoTime,
        fast: Duration,
    ) -> Option<(Lit, Pace)> {
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

    fn ended(&mut self, flash: Flash, fast: Duration) -> Option<(Lit, Pace)> {
        if self.lit != Some(flash.lit) {
            self.lit = Some(flash.lit);
            self.starts = [None; STARTS];
        }
        self.starts.rotate_left(1);
        self.starts[STARTS - 1] = Some(flash.start);
        let [Some(first), .., Some(last)] = self.starts else { return None };
        let three_fast = fast.saturating_mul(3);
        // The cycles took at most from the dark frame before them, at least up to the last dark one.
        let pace = if last.first_lit.since(first.last_dark) < three_fast {
            Pace::Fast
        } else if last.last_dark.since(first.first_lit) >= three_fast {
            Pace::Ordinary
        } else {
            Pace::Unproven
        };
        Some((flash.lit, pace))
    }

    /// The flashing is over: the next flash starts a new series.
    pub(super) fn over(&mut self) {
        self.starts = [None; STARTS];
    }

    /// Nothing seen before this counts.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }
}
