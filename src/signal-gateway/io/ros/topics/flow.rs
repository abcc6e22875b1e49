//! The flows to which topics belong, and the keys that name them.

/// The flow that a topic belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)] // their names say it
pub enum TopicFlow {
    VehicleLights,
    VehicleStatus,
    Gateway,
    TrafficLights,
    TurnSignal,
    Command,
}

/// A key of the configuration that names a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TopicKey {
    /// Section of the configuration, e.g. `ros.topics`.
    pub section: &'static str,
    /// Key in the section.
    pub key: &'static str,
}
