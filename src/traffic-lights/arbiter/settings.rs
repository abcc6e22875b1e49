//! Stamps and parameters of the arbiter (docs/spec/traffic-lights.md, "Inputs and tolerances").

use std::time::Duration;

/// Stamp of a message, nanoseconds since the epoch of the node's clock.
///
/// The tolerances compare stamps of messages with each other and with that clock; a `WallStamp` has no order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct ArbiterStamp(pub i64);

/// The side whose elements are preferred (`source_priority`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Priority {
    /// The side with the higher confidence, element by element.
    #[default]
    Confidence,
    /// The side of the network.
    External,
    /// The side of the camera.
    Perception,
}

/// Parameters of the node, with its own defaults (docs/spec/traffic-lights.md, "Inputs and tolerances").
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArbiterSettings {
    /// Maximum difference between an external stamp and the clock: `external_delay_tolerance`.
    pub external_delay_tolerance: Duration,
    /// Maximum difference between an external and a perception stamp: `external_time_tolerance`.
    pub external_time_tolerance: Duration,
    /// Maximum lag of perception behind the newest external stamp: `perception_time_tolerance`.
    pub perception_time_tolerance: Duration,
    /// The preferred side; it has no effect on vehicle groups if matching is on.
    pub priority: Priority,
    /// True if only elements that both sides report count: `enable_signal_matching`.
    pub matching: bool,
}

impl ArbiterStamp {
    /// Returns the time between two stamps, whichever is newer.
    pub const fn distance(self, other: Self) -> Duration {
        Duration::from_nanos(self.0.abs_diff(other.0))
    }
}

impl Default for ArbiterSettings {
    fn default() -> Self {
        Self {
            external_delay_tolerance: Duration::from_secs(5),
            external_time_tolerance: Duration::from_secs(5),
            perception_time_tolerance: Duration::from_secs(1),
            priority: Priority::default(),
            matching: false,
        }
    }
}
