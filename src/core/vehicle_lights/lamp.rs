//! Lamp feedback, which blinks, becomes a logical state, which does not.
//!
//! A side is on from its first lit frame until the hold has passed since its last. A frame with one
//! lamp lit alone says which side; both lit together mean hazard once a frame with both comes at
//! least the confirmation time after the first one, and none with a single lamp between: a
//! switch-over, which may show both for a frame, never gets there. One lamp lit alone for as long
//! ends hazard early. Off is a claim too: it is made only after watching dark lamps for a hold.
//!
//! Both lamps must come in the same message. Frames with one lamp of unknown state prove nothing.

mod flashing;
pub mod timing;

#[cfg(test)]
mod cases;
#[cfg(test)]
mod properties;

use super::state::TurnCode;
use crate::core::time::{MonoTime, deadline_after};
use flashing::{Flashes, Lit, Pace};
pub use timing::LampSettings;

/// Left and right, each with its own answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sides {
    /// Left side.
    pub left: bool,
    /// Right side.
    pub right: bool,
}

/// What is odd about the lamps. None of it changes the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LampFindings {
    /// One side alone flashed too fast, as flashers do when a bulb has failed. Stands until that
    /// side is seen flashing at an ordinary rate.
    pub bulb_failure: Sides,
    /// Lit for longer than the limit without a dark frame.
    pub does_not_flash: Sides,
    /// Both sides flash too fast for ordinary hazard lights: emergency braking or rear-end alert
    /// (4 ± 1 Hz). Needs frames at most half such a flash apart.
    pub emergency_flashing: bool,
}

/// Logical state of a pair of lamps.
#[derive(Debug, Clone)]
pub struct Lamp {
    settings: LampSettings,
    now: MonoTime,
    /// Since when each frame told both lamps; `None` while they are unknown.
    known_since: Option<MonoTime>,
    left: Side,
    right: Side,
    /// Both lamps lit, in frames with no single lamp between.
    both: Option<Run>,
    /// One lamp lit alone, in frames with neither both nor the other between.
    alone: Option<(TurnCode, Run)>,
    last_both: Option<MonoTime>,
    state: TurnCode,
    flashes: Flashes,
    findings: LampFindings,
}

#[derive(Debug, Clone, Copy, Default)]
struct Side {
    /// Lit in every frame since.
    lit_since: Option<MonoTime>,
    last_lit: Option<MonoTime>,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    since: MonoTime,
    last: MonoTime,
}

impl Lamp {
    /// Nothing seen yet.
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

    /// Takes a frame: `true` = lit, `None` = unknown. Also to be called, with `None`, when the last
    /// frame is no longer believed. A `now` before the last one counts as the last one.
    pub fn observe(&mut self, left: Option<bool>, right: Option<bool>, now: MonoTime) {
        self.advance(now);
        if self.settings.lit_until_changed {
            self.still_lit();
        }
        if let (Some(left), Some(right)) = (left, right) {
            self.frame(left, right);
        } else {
            self.lose_sight();
        }
        self.draw_conclusions();
    }

    /// Lets time pass without a frame.
    pub fn advance(&mut self, now: MonoTime) {
        self.now = self.now.max(now);
        if self.settings.lit_until_changed {
            self.confirm_by_time();
        }
        self.draw_conclusions();
    }

    /// The state, [`TurnCode::Both`] for hazard; `None` while lamps are unknown, or dark and not yet
    /// watched for long enough to tell off from the dark part of a flash.
    pub fn state(&self) -> Option<TurnCode> {
        let known_since = self.known_since?;
        let proven = self.state != TurnCode::Off || self.now.since(known_since) > self.settings.hold;
        proven.then_some(self.state)
    }

    /// What is odd.
    pub fn findings(&self) -> LampFindings {
        self.findings
    }

    /// When to call [`Self::advance`] with no frame coming.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        let over = self.state_until().map(|last| deadline_after(last, self.settings.hold));
        let off_proven = self.known_since.map(|since| deadline_after(since, self.settings.hold));
        let steady =
            |side: Side| side.lit_since.map(|since| deadline_after(since, self.settings.stuck_on_after));
        let confirmed = self.run_by_time().map(|run| run.since.after(self.settings.confirm));
        [over, off_proven, steady(self.left), steady(self.right), confirmed]
            .into_iter()
            .flatten()
            .filter(|at| *at > self.now)
            .min()
    }

    fn frame(&mut self, left: bool, right: bool) {
        self.known_since.get_or_insert(self.now);
        self.left.frame(left, self.now);
        self.right.frame(right, self.now);
        match (left, right) {
            (true, true) => self.both_lit(),
            (true, false) => self.one_lit(TurnCode::Left),
            (false, true) => self.one_lit(TurnCode::Right),
            (false, false) => {}
        }
        if let Some((lit, pace)) = self.flashes.frame(left, right, self.now, self.settings.fast_period) {
            self.judge_pace(lit, pace);
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

    fn lose_sight(&mut self) {
        self.known_since = None;
        self.left.lit_since = None;
        self.right.lit_since = None;
        self.both = None;
        self.alone = None;
        self.flashes.forget();
    }

    /// What was lit stayed lit until now.
    fn still_lit(&mut self) {
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

    /// The run that goes on without frames and will decide something.
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
            self.state = match self.alone {
                Some((side, _)) => side,
                None => TurnCode::Both,
            };
        }
    }

    /// When what the state rests on was last seen; `None` when that is lasting, or nothing.
    fn state_until(&self) -> Option<MonoTime> {
        let lasting = |side: Side| self.settings.lit_until_changed && side.lit_since.is_some();
        match self.state {
            TurnCode::Off => None,
            TurnCode::Left => self.left.last_lit.filter(|_| !lasting(self.left)),
            TurnCode::Right => self.right.last_lit.filter(|_| !lasting(self.right)),
            TurnCode::Both => self.last_both.filter(|_| !(lasting(self.left) && lasting(self.right))),
        }
    }

    fn draw_conclusions(&mut self) {
        let hold = self.settings.hold;
        // Twice: hazard can give way to one side, and that side be over as well.
        for _ in 0..2 {
            if self.state_until().is_some_and(|last| self.now.since(last) > hold) {
                self.state = match (self.state, self.alone) {
                    (TurnCode::Both, Some((side, _))) => side,
                    (TurnCode::Off | TurnCode::Left | TurnCode::Right | TurnCode::Both, _) => TurnCode::Off,
                };
            }
        }
        if self.state == TurnCode::Off && self.both.is_none() {
            self.flashes.over();
        }
        if self.state != TurnCode::Both {
            self.findings.emergency_flashing = false;
        }
        let steady = |side: Side| {
            side.lit_since.is_some_and(|since| self.now.since(since) > self.settings.stuck_on_after)
        };
        self.findings.does_not_flash = Sides { left: steady(self.left), right: steady(self.right) };
    }

    fn judge_pace(&mut self, lit: Lit, pace: Pace) {
        let fast = match pace {
            Pace::Fast => true,
            Pace::Ordinary => false,
            Pace::Unproven => return,
        };
        match lit {
            Lit::Left => self.findings.bulb_failure.left = fast,
            Lit::Right => self.findings.bulb_failure.right = fast,
            Lit::Both => self.findings.emergency_flashing = fast,
        }
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
