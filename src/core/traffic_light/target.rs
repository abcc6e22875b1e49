//! Which store of which channel a state is for (docs/spec/traffic-lights.md, "Stores and channels").

/// Over which equipment a state reaches the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Lamps that a camera detects.
    Conventional,
    /// Messages of a network.
    V2i,
}

impl Channel {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Conventional, Self::V2i];
}

/// What is so, or what the vehicle's pipeline makes of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// What is so.
    GroundTruth,
    /// What the pipeline reports instead.
    Detected,
}

/// One of the four stores.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StoreId {
    /// Over which equipment.
    pub channel: Channel,
    /// Truth or detection.
    pub layer: Layer,
}

/// A light or group in one of the stores: `34802`, `34802 v2i_detected`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Target {
    /// Way id of a signal head, or relation id of a group.
    pub id: i64,
    /// In which store.
    pub store: StoreId,
}
