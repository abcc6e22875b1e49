//! The four stores of light states (docs/spec/traffic-lights.md, "Stores and channels").

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The equipment over which a state reaches the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LightChannel {
    /// Lamps that a camera detects.
    Conventional,
    /// Messages of a network.
    V2i,
}

impl LightChannel {
    /// Both channels, in the order of their numbers.
    pub const ALL: [Self; 2] = [Self::Conventional, Self::V2i];

    /// Returns the name in diagnostics, which is also the name of the channel's ground truth.
    pub fn name(self) -> &'static str {
        StoreId { channel: self, layer: StoreLayer::GroundTruth }.name()
    }
}

/// The origin of a state: the light itself, or the vehicle's perception of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StoreLayer {
    /// The state that the light has.
    GroundTruth,
    /// The state that the perception pipeline reports instead.
    Detected,
}

/// One of the four stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Display)]
#[display("{}", self.name())]
pub struct StoreId {
    /// The equipment over which its states reach the vehicle.
    pub channel: LightChannel,
    /// The origin of its states.
    pub layer: StoreLayer,
}

impl StoreId {
    /// Ground truth of the conventional channel, the default for an id without a channel.
    pub const CONVENTIONAL: Self =
        Self { channel: LightChannel::Conventional, layer: StoreLayer::GroundTruth };
    /// Ground truth of the V2I channel.
    pub const V2I: Self = Self { channel: LightChannel::V2i, layer: StoreLayer::GroundTruth };
    /// All four stores, in the order in which reports list them.
    pub const ALL: [Self; 4] = [
        Self::CONVENTIONAL,
        Self { layer: StoreLayer::Detected, ..Self::CONVENTIONAL },
        Self::V2I,
        Self { layer: StoreLayer::Detected, ..Self::V2I },
    ];
}

/// A light or group in one of the stores: `34802`, `34802 v2i_detected`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SignalTarget {
    /// Way id of a signal head, or relation id of a group.
    pub id: i64,
    /// The store that holds its state.
    pub store: StoreId,
}
