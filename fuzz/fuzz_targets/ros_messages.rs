//! Any bytes on any topic we read, in both byte orders: no panic, and whatever is read is within bounds.
//!
//! The first byte picks the topic's kind, the second the byte order.

#![no_main]

use libfuzzer_sys::fuzz_target;
use signal_gateway::core::traffic_light::target::{Channel, Layer, StoreId};
use signal_gateway::core::turn_signal::told::{FactorTopic, Told};
use signal_gateway::io::ros::incoming::Incoming;
use signal_gateway::io::ros::reading::{Endian, read};
use signal_gateway::io::ros::topics::SubscriptionKind;

const KINDS: [SubscriptionKind; 14] = [
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
    SubscriptionKind::Groups(StoreId { channel: Channel::V2i, layer: Layer::Detected }),
];

fuzz_target!(|bytes: &[u8]| {
    let [kind, endian, bytes @ ..] = bytes else { return };
    let kind = KINDS[usize::from(*kind) % KINDS.len()];
    let endian = if endian & 1 == 0 { Endian::Little } else { Endian::Big };
    let Ok(incoming) = read(kind, bytes, endian) else { return };
    // Nothing can hold more than its bytes do: an element of a sequence has at least four.
    let elements = match &incoming {
        Incoming::Told(Told::Route(route)) => route.segments.len(),
        Incoming::Told(Told::PlannedPath(points)) => points.len(),
        Incoming::Told(Told::Factors { factors, .. }) => factors.len(),
        Incoming::Groups { groups, .. } => groups.groups.len() + groups.rejected.len(),
        Incoming::Told(_)
        | Incoming::Command(_)
        | Incoming::TurnCommand { .. }
        | Incoming::HazardCommand { .. }
        | Incoming::ControlMode { .. } => 0,
    };
    assert!(elements <= bytes.len() / 4, "{elements} elements in {} bytes", bytes.len());
});
