//! The phases of controllers (docs/spec/traffic-lights.md, "Controllers and phases").
//!
//! A controller makes at most one transition per frame. In improved mode a phase begins at the nominal end of
//! the previous phase, so that frames do not delay the schedule (Q21); upstream's phases begin with the
//! frame.

use std::collections::BTreeSet;
use std::time::Duration;

use super::periodic_timer::ScenarioMoment;
use super::quirks::LightQuirks;
use super::scenario::{ControllerIndex, Phase, Scenario, TrafficSignalController};
use gateway_base::time::WallStamp;

#[derive(Debug, Clone)]
pub(super) struct Controllers {
    quirks: LightQuirks,
    states: Vec<ControllerProgress>,
    /// For each controller, the time before which it has nothing to do, nanoseconds since the start of the
    /// scenario; 0 if it may have.
    idle_until: Vec<u64>,
    /// The controllers that may have something to do in the next frame.
    awake: BTreeSet<usize>,
    /// The other controllers, with the time before which they have nothing to do.
    asleep: BTreeSet<(u64, usize)>,
    /// For each controller, its followers and their delays.
    followers: Vec<Vec<(usize, Duration)>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ControllerProgress {
    /// Position of the current phase; `None` before the first one.
    pub(super) phase: Option<usize>,
    pub(super) start: ScenarioMoment,
    /// The wall-clock time at the start of the phase.
    pub(super) start_wall: WallStamp,
    /// The moment after which it enters its first phase, set by the controller that it follows.
    begin: Option<ScenarioMoment>,
}

/// The current and the previous frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameTimes {
    pub(super) now: ScenarioMoment,
    pub(super) previous: Option<ScenarioMoment>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Transition {
    pub(super) phase: usize,
    pub(super) start: ScenarioMoment,
}

impl Controllers {
    pub(super) fn new(scenario: &Scenario, quirks: LightQuirks) -> Self {
        let mut followers = vec![Vec::new(); scenario.controllers.len()];
        for (index, controller) in scenario.controllers.iter().enumerate() {
            if let Some(reference) = controller.reference
                && let Some(of_controller) = followers.get_mut(reference.controller.0)
            {
                of_controller.push((index, reference.delay));
            }
        }
        let states = vec![ControllerProgress::default(); scenario.controllers.len()];
        let (awake, asleep) = ((0..states.len()).collect(), BTreeSet::new());
        Self { quirks, idle_until: vec![0; states.len()], awake, asleep, states, followers }
    }

    pub(super) fn state(&self, controller: ControllerIndex) -> Option<&ControllerProgress> {
        self.states.get(controller.0)
    }

    /// Returns the present phase of a controller; `None` before the first one (Q12).
    pub(super) fn phase<'a>(&self, scenario: &'a Scenario, index: ControllerIndex) -> Option<&'a Phase> {
        scenario.controllers.get(index.0)?.phases.get(self.state(index)?.phase?)
    }

    /// Returns the first controller, starting with `from`, that may have something to do in this frame.
    pub(super) fn next_awake(&mut self, from: usize, frame: FrameTimes) -> Option<usize> {
        while let Some((until, index)) = self.asleep.first().copied().filter(|(at, _)| *at <= frame.now.nanos)
        {
            self.asleep.remove(&(until, index));
            self.awake.insert(index);
        }
        self.awake.range(from..).next().copied()
    }

    /// Returns the transition of a controller in this frame; `None` if it stays in its phase.
    pub(super) fn due(
        &mut self,
        index: usize,
        controller: &TrafficSignalController,
        frame: FrameTimes,
    ) -> Option<Transition> {
        let due = self.transition(index, controller, frame);
        if due.is_none() {
            let until = self.next(index, controller);
            self.set_idle(index, until);
        }
        due
    }

    fn transition(
        &mut self,
        index: usize,
        controller: &TrafficSignalController,
        frame: FrameTimes,
    ) -> Option<Transition> {
        let (quirks, now) = (self.quirks, frame.now);
        let state = &mut self.states[index];
        let begins = match controller.reference {
            None => state.phase.is_none().then_some(now),
            Some(_) => state.begin.take_if(|begin| begin.is_past(now, quirks)),
        };
        if let Some(begin) = begins {
            if controller.phases.is_empty() {
                self.inform(index, now);
                return None;
            }
            let start = self.nominal(begin, frame);
            let state = &self.states[index];
            // Improved mode does not re-enter the first phase if the cycle has already reached it.
            let has_begun =
                !quirks.repeats_first_phase && state.phase == Some(0) && state.start.nanos >= begin.nanos;
            if !has_begun {
                return Some(Transition { phase: 0, start });
            }
        }
        let ControllerProgress { phase, start, .. } = self.states[index];
        let phase = phase?;
        let duration = controller.phases[phase].duration?;
        start.has_lasted(duration, now, quirks).then(|| Transition {
            phase: (phase + 1) % controller.phases.len(),
            start: self.nominal(start.after(duration), frame),
        })
    }

    /// Enters a phase. Notifies the followers if it is the first phase.
    pub(super) fn enter(&mut self, index: usize, to: Transition, start_wall: WallStamp) {
        if to.phase == 0 {
            self.inform(index, to.start);
        }
        let state = &mut self.states[index];
        (state.phase, state.start, state.start_wall) = (Some(to.phase), to.start, start_wall);
        self.set_idle(index, 0);
    }

    /// Returns the earliest time of the next transition, nanoseconds; 0 if upstream's clock decides.
    fn next(&self, index: usize, controller: &TrafficSignalController) -> u64 {
        if self.quirks.slips_by_frames {
            return 0;
        }
        let state = &self.states[index];
        let Some(phase) = state.phase else {
            let is_first = controller.reference.is_none();
            return if is_first { 0 } else { state.begin.map_or(u64::MAX, |begin| begin.nanos) };
        };
        let end = controller.phases[phase].duration.map(|duration| state.start.after(duration));
        end.into_iter().chain(state.begin).map(|moment| moment.nanos).min().unwrap_or(u64::MAX)
    }

    fn set_idle(&mut self, index: usize, until: u64) {
        let before = std::mem::replace(&mut self.idle_until[index], until);
        self.awake.remove(&index);
        self.asleep.remove(&(before, index));
        if until == 0 {
            self.awake.insert(index);
        } else {
            self.asleep.insert((until, index));
        }
    }

    fn inform(&mut self, index: usize, start: ScenarioMoment) {
        for position in 0..self.followers[index].len() {
            let (follower, delay) = self.followers[index][position];
            self.states[follower].begin = Some(start.after(delay));
            self.set_idle(follower, 0);
        }
    }

    /// Returns the nominal time if this is the first frame after it; otherwise frames were missed, and the
    /// schedule restarts with this frame.
    fn nominal(&self, at: ScenarioMoment, frame: FrameTimes) -> ScenarioMoment {
        let is_new = frame.previous.is_none_or(|previous| at.nanos > previous.nanos);
        if is_new && at.nanos <= frame.now.nanos && !self.quirks.slips_by_frames { at } else { frame.now }
    }
}

#[cfg(test)]
mod tests;
