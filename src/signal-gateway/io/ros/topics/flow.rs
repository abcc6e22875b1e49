//! The flows to which topics belong.

/// The flow that a topic belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum TopicFlow {
    VehicleLights,
    VehicleStatus,
    Gateway,
    TrafficLights,
    TurnSignal,
    Command,
}
