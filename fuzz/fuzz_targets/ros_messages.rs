//! Any bytes on any topic we read, in both byte orders, and as a call in a recording of the gateway: no
//! panic, and whatever is read is within bounds.
//!
//! The first byte picks the topic's kind, the second the byte order.

#![no_main]

use libfuzzer_sys::fuzz_target;
use gateway_core::command::origin::SampleId;
use gateway_core::gateway::call::{GatewayCall as Call, TimedCall};
use gateway_core::gateway::event::Input;
use traffic_lights::input::TrafficLightInput;
use traffic_lights::target::{LightChannel, StoreLayer, StoreId};
use turn_signal::planner_input::{FactorTopic, PlannerInput};
use ros_messages::cdr::{Endian, read_message};
use signal_gateway::io::ros::messages::timed_call;
use signal_gateway::io::ros::reading::read;
use signal_gateway::io::ros::topics::SubscriptionKind;

const KINDS: [SubscriptionKind; 18] = [
    SubscriptionKind::Odometry,
    SubscriptionKind::Route,
    SubscriptionKind::PlannedPath,
    SubscriptionKind::Factors(FactorTopic::GoalPlanner),
    SubscriptionKind::OperationMode,
    SubscriptionKind::Scenario,
    SubscriptionKind::HazardRequest,
    SubscriptionKind::OwnTurnCommand,
    SubscriptionKind::OwnHazardCommand,
    SubscriptionKind::TurnCommand,
    SubscriptionKind::HazardCommand,
    SubscriptionKind::ControlMode,
    SubscriptionKind::Command,
    SubscriptionKind::Groups(StoreId { channel: LightChannel::V2i, layer: StoreLayer::Detected }),
    SubscriptionKind::Camera,
    SubscriptionKind::Clock,
    SubscriptionKind::ModifiedGoal,
    SubscriptionKind::Trajectory,
];

fuzz_target!(|bytes: &[u8]| {
    let [kind, endian, bytes @ ..] = bytes else { return };
    let endian = if endian & 1 == 0 { Endian::Little } else { Endian::Big };
    let Some(&kind) = KINDS.get(usize::from(*kind) % (KINDS.len() + 1)) else {
        let call = read_message(bytes, endian).ok().and_then(|message| timed_call(&message));
        // A link has a length and a character at least.
        assert!(!matches!(call, Some(TimedCall { call: Call::Start(links), .. }) if links.len() > bytes.len() / 5));
        return;
    };
    let Ok(input) = read(kind, SampleId::default(), bytes, endian) else { return };
    // Nothing can hold more than its bytes do: an element of a sequence has at least four.
    let elements = match &input {
        Input::Planner(PlannerInput::Route(route)) => route.segments.len(),
        Input::Planner(PlannerInput::PlannedPath(points)) => points.len(),
        Input::Planner(PlannerInput::Trajectory(points)) => points.len(),
        Input::Planner(PlannerInput::Factors { factors, .. }) => factors.len(),
        Input::TrafficLight(TrafficLightInput::States { states, rejected, .. }) => {
            let predictions: usize = states.iter().flat_map(|(_, state)| state).map(|state| state.predictions.len()).sum();
            states.len() + predictions + usize::try_from(*rejected).unwrap()
        }
        Input::TrafficLight(TrafficLightInput::Camera { groups, rejected, .. }) => {
            groups.len() + usize::try_from(*rejected).unwrap()
        }
        Input::Planner(_)
        | Input::TrafficLight(TrafficLightInput::Clock(_) | TrafficLightInput::Command(_))
        | Input::Command(_)
        | Input::Can(_)
        | Input::Tick => 0,
    };
    assert!(elements <= bytes.len() / 4, "{elements} elements in {} bytes", bytes.len());
});
