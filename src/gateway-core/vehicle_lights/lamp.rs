//! Derives the steady state of the turn indicators from flashing lamps.
//!
//! A side is on from its first lit frame until the hold time has passed since its last lit frame. A frame
//! with a single lamp lit shows the side. Two lit lamps mean hazard if another such frame follows after at
//! least the confirmation time, with no single lamp lit in between. A change of sides, which may show both
//! for a frame, is therefore not hazard. A single lamp lit for the confirmation time ends hazard early. Off
//! is reported only after dark lamps have been observed for a hold time.
//!
//! Both lamps must be in the same message. A frame in which a lamp is unknown is treated as unknown.

mod flashing;
pub mod timing;

#[cfg(test)]
mod cases;
#[cfg(test)]
mod properties;

use super::state::{Sides, StateMachine, TurnCode};
use flashing::Flashes;
use gateway_base::time::{MonoTime, deadline_after};
pub use timing::LampSettings;

/// Irregularities of the lamps; they do not change the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LampFindings {
    /// A single side flashed too fast, as flashers do when a bulb has failed. Remains set until that side
    /// flashes at an ordinary rate.
    pub bulb_failure: Sides,
    /// The lamp has been lit for longer than the limit without a dark frame.
    pub does_not_flash: Sides,
    /// Both sides flash too fast for ordinary hazard lights, as with emergency braking or a rear-end
    /// alert (4 ± 1 Hz). Requires frames at most half such a flash apart.
    pub emergency_flashing: bool,
}

/// State machine of a pair of lamps.
#[derive(Debug, Clone)]
pub struct Lamp {
    settings: LampSettings,
    now: MonoTime,
    /// First of the successive frames that show both lamps; `None` while they are unknown.
    known_since: Option<MonoTime>,
    left: Side,
    right: Side,
    /// Frames with both lamps lit, without a frame with a single lamp in between.
    both: Option<Run>,
    /// Frames with a single lamp lit, without a frame with both or the other in between.
    alone: Option<(TurnCode, Run)>,
    last_both: Option<MonoTime>,
    state: TurnCode,
    flashes: Flashes,
    findings: LampFindings,
}

#[derive(Debug, Clone, Copy, Default)]
struct Side {
    /// First of the successive lit frames.
    lit_since: Option<MonoTime>,
    last_lit: Option<MonoTime>,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    since: MonoTime,
    last: MonoTime,
}

impl Lamp {
    /// Creates the machine before any frame.
    pub fn new(settings: LampSettings) -> Self {
        Self {
            settings,
            now: MonoTime::ZERO,
            known_since: None,
            left: Side::default(),
            right: Side::default(),
            both: None,
            alone: None,
            last_both: None,
            state: TurnCode::Off,
            flashes: Flashes::default(),
            findings: LampFindings::default(),
        }
    }

    /// Discards every frame, as after a lost link.
    pub fn forget(&mut self) {
        *self = Self::new(self.settings);
    }

    /// Returns the irregularities of the lamps.
    pub fn findings(&self) -> LampFindings {
        self.findings
    }

    fn frame(&mut self, lamps: Sides) {
        let lit = TurnCode::from_sides(lamps);
        self.known_since.get_or_insert(self.now);
        self.left.frame(lamps.left, self.now);
        self.right.frame(lamps.right, self.now);
        match lit {
            TurnCode::Both => self.both_lit(),
            TurnCode::Left | TurnCode::Right => self.one_lit(lit),
            TurnCode::Off => {}
        }
        if let Some((lit, is_fast)) = self.flashes.frame(lit, self.now, self.settings.fast_period) {
            match lit {
                TurnCode::Left => self.findings.bulb_failure.left = is_fast,
                TurnCode::Right => self.findings.bulb_failure.right = is_fast,
                TurnCode::Both => self.findings.emergency_flashing = is_fast,
                TurnCode::Off => {}
            }
        }
    }

    fn both_lit(&mut self) {
        self.alone = None;
        self.last_both = Some(self.now);
        let run = self.continued(self.both);
        self.both = Some(run);
        if self.is_confirmed(run) {
            self.state = TurnCode::Both;
        }
    }

    fn one_lit(&mut self, side: TurnCode) {
        self.both = None;
        let run = self.continued(self.alone.filter(|(before, _)| *before == side).map(|(_, run)| run));
        self.alone = Some((side, run));
        if self.state != TurnCode::Both || self.is_confirmed(run) {
            self.state = side;
        }
    }

    fn continued(&self, run: Option<Run>) -> Run {
        let fresh = run.filter(|run| self.now.since(run.last) <= self.settings.hold);
        Run { since: fresh.map_or(self.now, |run| run.since), last: self.now }
    }

    fn is_confirmed(&self, run: Run) -> bool {
        self.now.since(run.since) >= self.settings.confirm
    }

    fn unknown_frame(&mut self) {
        self.known_since = None;
        self.left.lit_since = None;
        self.right.lit_since = None;
        self.both = None;
        self.alone = None;
        self.flashes.forget();
    }

    /// Extends the lit time of lit lamps to the current time.
    fn extend_lit(&mut self) {
        let (left, right) = (self.left.lit_since.is_some(), self.right.lit_since.is_some());
        self.left.last_lit = if left { Some(self.now) } else { self.left.last_lit };
        self.right.last_lit = if right { Some(self.now) } else { self.right.last_lit };
        if left && right {
            self.last_both = Some(self.now);
            self.both = self.both.map(|run| Run { last: self.now, ..run });
        } else if left || right {
            self.alone = self.alone.map(|(side, run)| (side, Run { last: self.now, ..run }));
        }
    }

    /// Returns the run that continues without frames and will change the state; `None` if there is none.
    fn run_by_time(&self) -> Option<Run> {
        if !self.settings.lit_until_changed {
            return None;
        }
        match (self.left.lit_since.is_some(), self.right.lit_since.is_some()) {
            (true, true) => self.both.filter(|_| self.state != TurnCode::Both),
            (true, false) | (false, true) => {
                self.alone.map(|(_, run)| run).filter(|_| self.state == TurnCode::Both)
            }
            (false, false) => None,
        }
    }

    fn confirm_by_time(&mut self) {
        if self.run_by_time().is_some_and(|run| self.is_confirmed(run)) {
            self.state = self.alone.map_or(TurnCode::Both, |(side, _)| side);
        }
    }

    /// Returns the time of the last frame that supports the state; `None` if the state lasts without frames.
    fn state_until(&self) -> Option<MonoTime> {
        let lasting = |side: Side| self.settings.lit_until_changed && side.lit_since.is_some();
        match self.state {
            TurnCode::Off => None,
            TurnCode::Left => self.left.last_lit.filter(|_| !lasting(self.left)),
            TurnCode::Right => self.right.last_lit.filter(|_| !lasting(self.right)),
            TurnCode::Both => self.last_both.filter(|_| !(lasting(self.left) && lasting(self.right))),
        }
    }

    fn update_state(&mut self) {
        let hold = self.settings.hold;
        // Twice, since a side that replaces hazard may also have ended.
        for _ in 0..2 {
            if self.state_until().is_some_and(|last| self.now.since(last) > hold) {
                self.state = match (self.state, self.alone) {
                    (TurnCode::Both, Some((side, _))) => side,
                    (TurnCode::Off | TurnCode::Left | TurnCode::Right | TurnCode::Both, _) => TurnCode::Off,
                };
            }
        }
        if self.state == TurnCode::Off && self.both.is_none() {
            self.flashes.end_series();
        }
        if self.state != TurnCode::Both {
            self.findings.emergency_flashing = false;
        }
        let stuck_on = |side: Side| {
            side.lit_since.is_some_and(|since| self.now.since(since) > self.settings.stuck_on_after)
        };
        self.findings.does_not_flash = Sides { left: stuck_on(self.left), right: stuck_on(self.right) };
    }
}

impl StateMachine for Lamp {
    /// True for each lamp that is lit.
    type Input = Sides;
    type State = TurnCode;

    fn observe(&mut self, lamps: Option<Sides>, now: MonoTime) {
        self.advance(now);
        if self.settings.lit_until_changed {
            self.extend_lit();
        }
        match lamps {
            Some(lamps) => self.frame(lamps),
            None => self.unknown_frame(),
        }
        self.update_state();
    }

    fn advance(&mut self, now: MonoTime) {
        self.now = self.now.max(now);
        if self.settings.lit_until_changed {
            self.confirm_by_time();
        }
        self.update_state();
    }

    /// Returns [`TurnCode::Both`] for hazard; `None` also while dark lamps have not been observed for long
    /// enough to distinguish off from the dark part of a flash.
    fn state(&self) -> Option<TurnCode> {
        let known_since = self.known_since?;
        let proven = self.state != TurnCode::Off || self.now.since(known_since) > self.settings.hold;
        proven.then_some(self.state)
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        let over = self.state_until().map(|last| deadline_after(last, self.settings.hold));
        let off_proven = self.known_since.map(|since| deadline_after(since, self.settings.hold));
        let stuck_on =
            |side: Side| side.lit_since.map(|since| deadline_after(since, self.settings.stuck_on_after));
        let confirmed = self.run_by_time().map(|run| run.since.after(self.settings.confirm));
        [over, off_proven, stuck_on(self.left), stuck_on(self.right), confirmed]
            .into_iter()
            .flatten()
            .filter(|at| *at > self.now)
            .min()
    }
}

impl Side {
    fn frame(&mut self, lit: bool, now: MonoTime) {
        if lit {
            self.lit_since.get_or_insert(now);
            self.last_lit = Some(now);
        } else {
            self.lit_since = None;
        }
    }
}
