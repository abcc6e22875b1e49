//! The model of a scenario: controllers with phases, and events with triggers and actions
//! (docs/spec/traffic-lights.md, "Controllers and phases"). `config` reads it from a file, the engine runs
//! it.

use std::ops::Range;
use std::slice;
use std::time::Duration;

use super::bulb::{Bulb, BulbSet};
use super::target::SignalTarget;
use super::variable::{Modification, Variable, VariableIndex, VariableValue};

/// A scenario with its controllers and its storyboard.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scenario {
    /// The controllers in the order of the document, which is the order of evaluation.
    pub controllers: Vec<TrafficSignalController>,
    /// The declared parameters and variables.
    pub variables: Vec<Variable>,
    /// Actions performed once, before the first frame.
    pub init: Vec<Action>,
    /// The acts in the order of the document.
    pub acts: Vec<Act>,
    /// The stories to which conditions refer.
    pub stories: Vec<Story>,
    /// The trigger that ends the scenario; `None` if only an action ends it.
    pub stop: Option<Trigger>,
}

/// A controller, by position in [`Scenario::controllers`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ControllerIndex(pub usize);

/// A controller of phases (OpenSCENARIO `TrafficSignalController`).
#[derive(Debug, Clone, PartialEq)]
pub struct TrafficSignalController {
    /// Its name. It need not be unique; the first controller with a name counts.
    pub name: String,
    /// The controller that it follows; `None` if it runs independently.
    pub reference: Option<Reference>,
    /// The phases of its cycle; may be empty.
    pub phases: Vec<Phase>,
}

/// The leader of a following controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// The controller that is followed.
    pub controller: ControllerIndex,
    /// Time from the start of the leader's first phase to the start of the follower's.
    pub delay: Duration,
}

/// One phase of a controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Phase {
    /// Its name. It need not be unique; the first phase with a name counts.
    pub name: String,
    /// Its duration; `None` if it lasts until an action ends it.
    pub duration: Option<Duration>,
    /// The states that it sets, in the order of the document.
    pub entries: Vec<PhaseEntry>,
}

/// A state that a phase sets.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseEntry {
    /// The light or group to set, with its store.
    pub target: SignalTarget,
    /// The new state.
    pub state: StateText,
}

/// A state as text, and its interpretation.
///
/// Upstream parses the text only when applying it, bulb by bulb (Q20). So in upstream mode a text may contain
/// a mistake; improved mode refuses it when reading it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateText {
    /// The text as written.
    pub text: String,
    /// Its bulbs, up to the first mistake.
    pub bulbs: BulbSet,
    /// The first mistake in it, as text; `None` if there is none.
    pub mistake: Option<String>,
    /// The result of the single-bulb parser, which upstream uses for predictions and conditions; `None` if
    /// that parser refuses the text.
    pub single: Option<Bulb>,
}

/// Named acts.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// Name of the story, unique within the scenario, or a path of names.
    pub name: String,
    /// The positions of its acts.
    pub acts: Range<usize>,
}

/// Named events of an act: a maneuver, or a group of maneuvers. It runs while its act runs, until all of its
/// events are complete.
#[derive(Debug, Clone, PartialEq)]
pub struct EventGroup {
    /// Name of the group, unique within the scenario, or a path of names.
    pub name: String,
    /// The positions of the events in the act.
    pub events: Range<usize>,
}

/// Events that can happen while the act runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Act {
    /// Name of the act, or a path of names.
    pub name: String,
    /// The trigger that starts it; `None` if it starts at the first frame.
    pub start: Option<Trigger>,
    /// The trigger that stops it; `None` if there is none.
    pub stop: Option<Trigger>,
    /// Its events in the order of the document.
    pub events: Vec<Event>,
    /// The maneuvers and groups of maneuvers to which conditions refer.
    pub groups: Vec<EventGroup>,
}

/// Actions performed when a trigger fires.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Event {
    /// Name of the event, unique within the scenario, or a path of names.
    pub name: String,
    /// The trigger that starts it; `None` if it starts with its act.
    pub start: Option<Trigger>,
    /// Maximum number of executions, at least 1.
    pub max_executions: u32,
    /// Names of the actions, in the same order as `actions`.
    pub action_names: Vec<String>,
    /// The actions, all performed in one frame.
    pub actions: Vec<Action>,
}

/// Groups of conditions. It fires if all conditions of one of its groups are true; without groups, never.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trigger {
    /// The groups, each with its conditions.
    pub groups: Vec<Vec<Condition>>,
}

/// One condition, with its edge and delay.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its name in the document; may be empty.
    pub name: String,
    /// The test that provides the value.
    pub test: Test,
    /// The change of the value that makes the condition true.
    pub edge: Edge,
    /// Time by which the value is delayed.
    pub delay: Duration,
}

/// The change of a test's value that makes a condition true (OpenSCENARIO `ConditionEdge`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Edge {
    /// No change: the value itself.
    #[default]
    None,
    /// A change from false to true.
    Rising,
    /// A change from true to false.
    Falling,
    /// A change in either direction.
    RisingOrFalling,
    /// The value itself, latched once it is true: an extension of upstream.
    Sticky,
}

/// The test of a condition.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum Test {
    /// `SimulationTimeCondition`: the time since the start.
    SimulationTime {
        rule: Rule,
        /// Time since the start of the scenario.
        value: Duration,
    },
    /// `TrafficSignalCondition`: the state of a light or of all heads of a group.
    State {
        /// The light or group; in upstream mode only in the ground truth of the conventional channel.
        target: SignalTarget,
        /// The expected state; `None` if dark is expected (`none` or empty).
        state: Option<StateText>,
        /// True if the light must have exactly these bulbs; otherwise further bulbs are allowed (Q9).
        exact: bool,
    },
    /// `TrafficSignalControllerCondition`: the current phase's name.
    Phase { controller: ControllerIndex, phase: String },
    /// `ParameterCondition` and `VariableCondition`: the present value.
    Variable {
        variable: VariableIndex,
        rule: Rule,
        /// A value of the same kind.
        value: VariableValue,
    },
    /// `StoryboardElementStateCondition`, of a story, act, group of events, event or action by its name.
    Element { name: String, state: ElementState },
}

/// A comparison of two values (OpenSCENARIO `Rule`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // as named by OpenSCENARIO
pub enum Rule {
    EqualTo,
    NotEqualTo,
    GreaterThan,
    GreaterOrEqual,
    LessThan,
    LessOrEqual,
}

/// A state of an element of the storyboard (OpenSCENARIO `StoryboardElementState`). The transitions last one
/// frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // as named by OpenSCENARIO
pub enum ElementState {
    /// It has not started, or is waiting for its next execution.
    Standby,
    Running,
    Complete,
    StartTransition,
    EndTransition,
    StopTransition,
    /// It was skipped in this frame: this never happens, since all actions complete at once.
    SkipTransition,
}

/// An action on the lights, which completes at once
/// (docs/spec/traffic-lights.md, "Actions and commands").
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum Action {
    /// Replaces the state of the target: `TrafficSignalStateAction`.
    SetState { target: SignalTarget, state: StateText },
    /// Makes a light or group dark, or no longer detected: `ClearTrafficSignal`.
    Clear(SignalTarget),
    /// Enters a phase, whatever the current phase is: `TrafficSignalControllerAction`.
    EnterPhase {
        controller: ControllerIndex,
        /// Name of the phase. Improved mode checks it when reading it, upstream when using it.
        phase: String,
    },
    /// Replaces the V2I ground truth: `V2ITrafficSignalStateAction`.
    SetV2iState {
        /// Way or relation id.
        id: i64,
        state: StateText,
        /// New rate of the V2I topics, Hz, above zero; `None` keeps the present one.
        rate_hz: Option<f64>,
    },
    /// Sets the rate of the V2I topics, Hz, above zero.
    SetV2iRate(f64),
    /// Sets the rate of the ground-truth topic and of the markers, Hz, above zero.
    SetGroundTruthRate(f64),
    /// Starts copying the ground truth of way or relation ids, at least one, to V2I:
    /// `EnableTrafficSignalV2IFeatureAction@v1`.
    EnableV2i(Vec<i64>),
    /// Stops copying the ground truth of way or relation ids, at least one, to V2I:
    /// `DisableTrafficSignalV2IFeatureAction@v1`.
    DisableV2i(Vec<i64>),
    /// Sets a confidence: `PseudoTrafficSignalDetectorConfidenceSetAction@v1`.
    SetConfidence {
        /// The light or group; in upstream mode only in the ground truth of the conventional channel.
        target: SignalTarget,
        /// The new confidence, 0 to 1; upstream accepts any number.
        confidence: f64,
    },
    /// Sets a variable: `SetAction` of a `ParameterAction` or `VariableAction`.
    SetVariable {
        variable: VariableIndex,
        /// A value of the same kind.
        value: VariableValue,
    },
    /// Changes a numeric variable: `ModifyAction` of a `ParameterAction` or `VariableAction`.
    ModifyVariable { variable: VariableIndex, by: Modification },
    /// Ends the scenario; its controllers and events stop. `true` means `exitSuccess`, `false` means
    /// `exitFailure`.
    End(bool),
}

impl Action {
    /// Returns the ids of the heads and groups that it affects.
    pub fn ids(&self) -> &[i64] {
        match self {
            Self::SetState { target, .. } | Self::Clear(target) | Self::SetConfidence { target, .. } => {
                slice::from_ref(&target.id)
            }
            Self::SetV2iState { id, .. } => slice::from_ref(id),
            Self::EnableV2i(ids) | Self::DisableV2i(ids) => ids,
            Self::SetV2iRate(_)
            | Self::SetGroundTruthRate(_)
            | Self::EnterPhase { .. }
            | Self::SetVariable { .. }
            | Self::ModifyVariable { .. }
            | Self::End(_) => &[],
        }
    }
}

/// Returns the cycle time of upstream, seconds: truncated to a whole number after each addition. A sum out of
/// range becomes the lowest integer, as on x86 (Q11).
pub fn upstream_cycle_s(durations_s: impl Iterator<Item = f64>) -> i32 {
    durations_s.fold(0, |sum, seconds| {
        let sum = (f64::from(sum) + seconds).trunc();
        let fits = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&sum);
        #[expect(clippy::cast_possible_truncation, reason = "it is whole and fits")]
        if fits { sum as i32 } else { i32::MIN }
    })
}
