//! What shall happen: controllers with phases, and events with triggers and actions, as a scenario
//! file describes it (docs/spec/traffic-lights.md, "Controllers and phases"). Read by `config`, run by the engine.

use std::slice;
use std::time::Duration;

use super::bulb::BulbSet;
use super::target::Target;

/// A whole scenario.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scenario {
    /// In the order of the document, which is the order of evaluation.
    pub controllers: Vec<Controller>,
    /// Done once, before the first frame.
    pub init: Vec<Action>,
    /// In the order of the document.
    pub acts: Vec<Act>,
    /// Ends the scenario; none = it goes on for ever.
    pub stop: Option<Trigger>,
}

/// A controller, by position in [`Scenario::controllers`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ControllerIndex(pub usize);

/// A phase controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// Its name; need not be unique, the first one is meant.
    pub name: String,
    /// The controller that is followed, and the delay after its first phase.
    pub reference: Option<Reference>,
    /// Its cycle; may be empty.
    pub phases: Vec<Phase>,
}

/// How a controller follows another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference {
    /// Whom it follows.
    pub controller: ControllerIndex,
    /// How long after it, not negative.
    pub delay: Duration,
}

/// One phase of a controller.
#[derive(Debug, Clone, PartialEq)]
pub struct Phase {
    /// Its name; need not be unique, the first one is meant.
    pub name: String,
    /// How long it lasts; none = until an action ends it.
    pub duration: Option<Duration>,
    /// The states it sets, in the order of the document.
    pub entries: Vec<PhaseEntry>,
}

/// A state that a phase sets.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseEntry {
    /// Where.
    pub target: Target,
    /// What.
    pub state: StateText,
}

/// A state as it was written and as it is understood.
///
/// Upstream looks at the text only when it is applied, bulb by bulb (Q20). So a text may be wrong
/// here when upstream's behaviour was asked for; else it was refused when it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateText {
    /// As written.
    pub text: String,
    /// Its bulbs; those before the mistake, when there is one.
    pub bulbs: BulbSet,
    /// The mistake in it, if there is one.
    pub mistake: Option<String>,
    /// As the single-bulb parser understands it, which upstream uses for predictions and conditions;
    /// none = that parser refuses it.
    pub single: Option<super::bulb::Bulb>,
}

/// Events that can happen while it runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Act {
    /// Its name, or a path of names.
    pub name: String,
    /// Starts it; none = at the first frame.
    pub start: Option<Trigger>,
    /// Stops it; none = never.
    pub stop: Option<Trigger>,
    /// In the order of the document.
    pub events: Vec<Event>,
}

/// Actions that are done when a trigger fires.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Event {
    /// Its name, unique within the scenario or a path of names.
    pub name: String,
    /// Fires it; none = as soon as the act runs.
    pub start: Option<Trigger>,
    /// How often at most, at least once.
    pub most_executions: u32,
    /// Names of the actions, in the same order as `actions`.
    pub action_names: Vec<String>,
    /// What is done, all in one frame.
    pub actions: Vec<Action>,
}

/// True when all conditions of one of its groups are. Without groups it is never true.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trigger {
    /// Any of these, each all of its conditions.
    pub groups: Vec<Vec<Condition>>,
}

/// One condition, with its edge and delay.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// What it looks at.
    pub test: Test,
    /// Which change of it counts.
    pub edge: Edge,
    /// How long after that it is true.
    pub delay: Duration,
}

/// Which change of a test counts (OpenSCENARIO `ConditionEdge`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Edge {
    /// The value itself.
    #[default]
    None,
    /// From false to true.
    Rising,
    /// From true to false.
    Falling,
    /// Any.
    RisingOrFalling,
}

/// What a condition looks at.
#[derive(Debug, Clone, PartialEq)]
pub enum Test {
    /// `SimulationTimeCondition`
    SimulationTime {
        /// How time is compared.
        rule: Rule,
        /// With what.
        value: Duration,
    },
    /// `TrafficSignalCondition`: the state of a light or of all heads of a group.
    State {
        /// Where; upstream knows the ground truth of the conventional channel only.
        target: Target,
        /// None = dark (`none` or empty).
        state: Option<StateText>,
        /// The light must have these bulbs and no other; else these must be among its own (Q9).
        exact: bool,
    },
    /// `TrafficSignalControllerCondition`: the current phase's name.
    Phase {
        /// Of which controller.
        controller: ControllerIndex,
        /// The name.
        phase: String,
    },
    /// `StoryboardElementStateCondition`, of an act, event or action by its name.
    Element {
        /// Its name.
        name: String,
        /// The state or transition waited for.
        state: ElementState,
    },
}

/// OpenSCENARIO `Rule`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Rule {
    /// `equalTo`
    EqualTo,
    /// `notEqualTo`
    NotEqualTo,
    /// `greaterThan`
    GreaterThan,
    /// `greaterOrEqual`
    GreaterOrEqual,
    /// `lessThan`
    LessThan,
    /// `lessOrEqual`
    LessOrEqual,
}

/// OpenSCENARIO `StoryboardElementState`; the transitions are true for one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ElementState {
    /// Not started, or waiting for its next execution.
    Standby,
    /// Executing.
    Running,
    /// Done for good.
    Complete,
    /// Began in this frame.
    StartTransition,
    /// Ended in this frame.
    EndTransition,
    /// Was stopped in this frame.
    StopTransition,
}

/// Something to do with the lights; it completes at once
/// (docs/spec/traffic-lights.md, "Actions and commands").
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// `TrafficSignalStateAction`: takes the place of what the target had.
    SetState {
        /// Where.
        target: Target,
        /// What.
        state: StateText,
    },
    /// The target is dark, or no longer detected.
    Clear {
        /// Where.
        target: Target,
    },
    /// `TrafficSignalControllerAction`
    EnterPhase {
        /// Of which controller.
        controller: ControllerIndex,
        /// By name, since upstream looks it up when it runs; in improved mode it was checked when it was read.
        phase: String,
    },
    /// `V2ITrafficSignalStateAction`
    SetV2iState {
        /// Way or relation id.
        id: i64,
        /// What.
        state: StateText,
        /// Rate at which the V2I topics are published from now on, Hz, above zero.
        rate_hz: Option<f64>,
    },
    /// From now on the V2I topics are published at another rate.
    SetV2iRate {
        /// Hz, above zero.
        rate_hz: f64,
    },
    /// `EnableTrafficSignalV2IFeatureAction@v1`: ground truth is copied to V2I from now on.
    EnableV2i {
        /// Way or relation ids, at least one.
        ids: Vec<i64>,
    },
    /// `DisableTrafficSignalV2IFeatureAction@v1`
    DisableV2i {
        /// Way or relation ids, at least one.
        ids: Vec<i64>,
    },
    /// `PseudoTrafficSignalDetectorConfidenceSetAction@v1`
    SetConfidence {
        /// Way or relation id, in which store; upstream knows ground truth, conventional, only.
        target: Target,
        /// 0 to 1; upstream takes any number.
        confidence: f64,
    },
    /// Ends the scenario: controllers and events stand still from now on.
    End {
        /// `exitSuccess` or `exitFailure`.
        success: bool,
    },
}

impl Action {
    /// The ids of the heads and groups that it acts on.
    pub fn ids(&self) -> &[i64] {
        match self {
            Self::SetState { target, .. } | Self::Clear { target } | Self::SetConfidence { target, .. } => {
                slice::from_ref(&target.id)
            }
            Self::SetV2iState { id, .. } => slice::from_ref(id),
            Self::EnableV2i { ids } | Self::DisableV2i { ids } => ids,
            Self::SetV2iRate { .. } | Self::EnterPhase { .. } | Self::End { .. } => &[],
        }
    }
}
