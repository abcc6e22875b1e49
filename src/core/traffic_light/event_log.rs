//! What happened in the scenario, for timelines and logs.

use std::time::Duration;

use super::refusal::Refusal;
use super::scenario::ControllerIndex;

/// An event of the scenario with its time.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// Since the start of the scenario.
    pub at: Duration,
    /// What happened.
    pub what: ScenarioEvent,
}

/// What can happen. Positions are those in the scenario.
#[derive(Debug, Clone, PartialEq)]
pub enum ScenarioEvent {
    /// A controller entered a phase.
    PhaseEntered {
        /// The controller that entered it.
        controller: ControllerIndex,
        /// By position.
        phase: usize,
    },
    /// An act began.
    ActStarted {
        /// By position.
        act: usize,
    },
    /// An act ended: its events were all done, or its stop trigger fired.
    ActEnded {
        /// By position.
        act: usize,
    },
    /// An event began; its actions follow.
    EventStarted {
        /// By position.
        act: usize,
        /// By position within the act.
        event: usize,
    },
    /// An action was done.
    ActionDone(ActionSource),
    /// The scenario is over: controllers and events stand still from now on.
    Ended(ScenarioOutcome),
}

/// The source of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionSource {
    /// Of those done before the first frame, by position.
    Init(usize),
    /// Of an event.
    Event {
        /// By position.
        act: usize,
        /// By position within the act.
        event: usize,
        /// By position within the event.
        action: usize,
    },
    /// Asked for from outside the scenario.
    Outside,
}

/// How a scenario ended.
#[derive(Debug, Clone, PartialEq)]
pub enum ScenarioOutcome {
    /// By an `exitSuccess` action.
    Success,
    /// By an `exitFailure` action.
    Failure,
    /// By its stop trigger.
    Stopped,
    /// It could not be carried out further.
    Fault(Refusal),
}
