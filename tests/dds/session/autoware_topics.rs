//! The gateway's side of tests with Autoware: its topics, and the inputs that it received, as JSON.

use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::CommandOrigin;
use gateway_core::gateway::event::Input;
use serde_json::{Value, json};
use signal_gateway::io::ros::session::{OutgoingTopic, Subscription, SubscriptionKind, Topics};
use turn_signal::light_command::EnumOrUnknown;
use turn_signal::planner_input::{FactorTopic, PlannerInput};

/// Topics below `/`, in the order of the status.
pub(crate) const KINDS: [(&str, SubscriptionKind); 13] = [
    ("odometry", SubscriptionKind::Odometry),
    ("route", SubscriptionKind::Route),
    ("path", SubscriptionKind::PlannedPath),
    ("factors", SubscriptionKind::Factors(FactorTopic::GoalPlanner)),
    ("modified_goal", SubscriptionKind::ModifiedGoal),
    ("operation_mode", SubscriptionKind::OperationMode),
    ("scenario", SubscriptionKind::Scenario),
    ("hazard_request", SubscriptionKind::HazardRequest),
    ("own_turn", SubscriptionKind::OwnTurnCommand),
    ("own_hazard", SubscriptionKind::OwnHazardCommand),
    ("turn_command", SubscriptionKind::TurnCommand),
    ("hazard_command", SubscriptionKind::HazardCommand),
    ("control_mode", SubscriptionKind::ControlMode),
];

pub(crate) fn subscriptions() -> Vec<Subscription> {
    // Deeper than they are: a sample that is overtaken in time is not lost, however long the machine keeps
    // the session from taking it.
    let deep = |kind, name: &str| Subscription { depth: 1000, ..Subscription::new(name, kind) };
    KINDS.iter().map(|(name, kind)| deep(*kind, &format!("/{name}"))).collect()
}

pub(crate) fn topics() -> Topics {
    Topics::default()
        .with(OutgoingTopic::TurnCommand, "/commanded_turn")
        .with(OutgoingTopic::HazardCommand, "/commanded_hazard")
}

/// The input that was received, as JSON; of a large path the number of points. Null for other inputs.
pub(crate) fn shown(input: &Input) -> Value {
    match input {
        Input::Planner(PlannerInput::PlannedPath(points)) if points.len() > 100 => {
            json!({"points": points.len()})
        }
        Input::Planner(input) => json!({"input": format!("{input:?}")}),
        Input::Command(CommandInput::Turn { origin: CommandOrigin::Topic(_), command, stamp }) => {
            json!({"turn": number(*command, |command| command as u8), "sec": stamp.sec()})
        }
        Input::Command(CommandInput::Hazard { origin: CommandOrigin::Topic(_), command, stamp }) => {
            json!({"hazard": number(*command, |command| command as u8), "sec": stamp.sec()})
        }
        Input::Command(CommandInput::ControlMode { mode, stamp, .. }) => {
            json!({"mode": number(*mode, |mode| mode as u8), "sec": stamp.sec()})
        }
        Input::Command(_) | Input::TrafficLight(_) | Input::Can(_) | Input::Tick => Value::Null,
    }
}

fn number<T>(value: EnumOrUnknown<T>, known: fn(T) -> u8) -> u8 {
    match value {
        EnumOrUnknown::Known(value) => known(value),
        EnumOrUnknown::Unknown(number) => number,
    }
}
