//! Events of the scenario, for timelines and logs.

use std::time::Duration;

use super::refusal::ActionRefusal;
use super::scenario::ControllerIndex;

/// An event of the scenario with its time.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedEvent {
    /// Time since the start of the scenario.
    pub at: Duration,
    /// The kind of event, with its positions.
    pub event: ScenarioEvent,
}

/// An event of the scenario. Acts, events and phases are given by their positions in the scenario.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // positions in the scenario; of a phase in the cycle, of an event in its act
pub enum ScenarioEvent {
    /// A controller entered a phase.
    PhaseEntered { controller: ControllerIndex, phase: usize },
    /// The act at this position has begun.
    ActStarted(usize),
    /// The act at this position ended: all its events were complete, or its stop trigger fired.
    ActEnded(usize),
    /// An event began; its actions follow.
    EventStarted { act: usize, event: usize },
    /// An action was performed.
    ActionDone(ActionSource),
    /// The scenario has ended; its controllers and events have stopped.
    Ended(ScenarioOutcome),
}

/// The source of an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // positions in the scenario: of an event in its act, of an action in its event
pub enum ActionSource {
    /// An init action, performed before the first frame, by its position.
    Init(usize),
    /// An action of an event.
    Event { act: usize, event: usize, action: usize },
    /// A command from outside the scenario.
    Outside,
}

/// The end of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub enum ScenarioOutcome {
    /// An `exitSuccess` action ended the scenario.
    Success,
    /// An `exitFailure` action ended the scenario.
    Failure,
    /// The stop trigger of the scenario fired.
    Stopped,
    /// The scenario could not continue.
    Fault(ActionRefusal),
}
